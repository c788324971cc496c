// SPDX-License-Identifier: Apache-2.0
#include "model/gap/learn.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "model/gap/constants.hpp"
#include "model/numeric/text.hpp"
#include "model/effects/learned/learned.hpp"

namespace loopwarden::gap {
namespace {

using numeric::text;

using effects::Block;
using effects::EffectSpec;
using effects::Points;

constexpr std::size_t kBlocks = 16;  // of the fitted part, each left out once
constexpr double kRidge = 1e-5;      // of each column's own square
constexpr std::array kIntervals{3, 5, 8};
constexpr std::array kLagOrders{1, 2, 3};
constexpr std::array kPlayCounts{1, 3};

struct Hat {
  Points points;
  double reset(double u) const noexcept { return step(u); }
  double step(double u) const noexcept { return effects::interpolate(points, u); }
  void set_severity(double) noexcept {}
};

struct HatOfTime {
  Points points;
  double reset(double u) const noexcept { return step(u, 0.0); }
  double step(double u, double time_s) const noexcept {
    return effects::interpolate(points, time_s) * u;
  }
  void set_severity(double) noexcept {}
};

// Of a law, what it adds to its input.
template <class Law>
struct Added {
  Law law;
  double reset(double u) noexcept { return law.reset(u) - u; }
  double step(double u) noexcept { return law.step(u) - u; }
  void set_severity(double) noexcept {}
};

struct Itself {
  double reset(double u) const noexcept { return u; }
  double step(double u) const noexcept { return u; }
  void set_severity(double) noexcept {}
};

struct Form {
  Block block = Block::valve;
  std::vector<effects::Effect> basis;
  std::function<EffectSpec(const std::vector<double>& c)> spec;
};

std::vector<double> knots(double from, double to, int intervals) {
  std::vector<double> out;
  for (int i = 0; i <= intervals; ++i) out.push_back(from + (to - from) * i / intervals);
  return out;
}

Points hat(const std::vector<double>& at, std::size_t top) {
  Points points;
  for (std::size_t i = 0; i < at.size(); ++i) points.emplace_back(at[i], i == top ? 1.0 : 0.0);
  return points;
}

Form static_form(const std::vector<double>& at) {
  Form form;
  for (std::size_t i = 0; i < at.size(); ++i) form.basis.emplace_back(Hat{hat(at, i)});
  form.spec = [at](const std::vector<double>& c) {
    EffectSpec spec{"learned", {}, {{"form", "static"}}};
    std::size_t worst = 0;
    for (std::size_t i = 0; i < at.size(); ++i) {
      spec.table.emplace_back(at[i], at[i] + c[i]);
      if (std::abs(c[i]) > std::abs(c[worst])) worst = i;
    }
    spec.options["description"] = text(
        "from CO %.3g to %.3g the flow is not what CO asks for: most at CO %.3g, where it is as it "
        "should be "
        "at CO %.3g",
        at.front(), at.back(), at[worst], at[worst] + c[worst]);
    return spec;
  };
  return form;
}

Form gain_over_time(const std::vector<double>& at) {
  Form form{.block = Block::process, .basis = {}, .spec = {}};
  for (std::size_t i = 0; i < at.size(); ++i) form.basis.emplace_back(HatOfTime{hat(at, i)});
  form.spec = [at](const std::vector<double>& c) {
    EffectSpec spec{"learned", {}, {{"form", "gain_profile"}, {"over", "time"}}};
    std::size_t least = 0;
    std::size_t most = 0;
    for (std::size_t i = 0; i < at.size(); ++i) {
      spec.table.emplace_back(at[i], 1.0 + c[i]);
      if (c[i] < c[least]) least = i;
      if (c[i] > c[most]) most = i;
    }
    spec.options["description"] =
        text("the process gain changes with time: %.3g of the model's at %.0f s, %.3g at %.0f s",
             1.0 + c[least], at[least], 1.0 + c[most], at[most]);
    return spec;
  };
  return form;
}

Form play_form(double widest, int count) {
  Form form;
  form.basis.emplace_back(Itself{});
  form.basis.emplace_back(Hat{{{0.0, 1.0}}});
  Points thresholds;
  for (int j = 1; j <= count; ++j) {
    thresholds.emplace_back(widest * j / count, 1.0);
    form.basis.emplace_back(
        Added<effects::LearnedPlay>{effects::LearnedPlay({thresholds.back()}, 0.0)});
  }
  form.spec = [thresholds](const std::vector<double>& c) {
    EffectSpec spec{"learned", {{"offset", c[1]}}, {{"form", "hysteretic"}}};
    double straight = 1.0 + c[0];
    double late = 0.0;
    for (std::size_t j = 0; j < thresholds.size(); ++j) {
      straight -= c[j + 2];
      late += 2.0 * thresholds[j].first * c[j + 2];
    }
    spec.table.emplace_back(0.0, straight);
    for (std::size_t j = 0; j < thresholds.size(); ++j) {
      spec.table.emplace_back(thresholds[j].first, c[j + 2]);
    }
    spec.options["description"] = text(
        "after each reversal of CO the flow stays behind by up to %.3g CO units, made up over the "
        "next %.3g",
        late, 2.0 * thresholds.back().first);
    return spec;
  };
  return form;
}

// (T p + 1)^power, by rising powers of p.
effects::LearnedFilter::Coefficients lags(double time_constant_s, int power) {
  effects::LearnedFilter::Coefficients out{1.0};
  for (int i = 0; i < power; ++i) {
    for (std::size_t k = out.size(); k-- > 1;) out[k] += time_constant_s * out[k - 1];
  }
  return out;
}

Form lag_form(double time_constant_s, int order, double period_s) {
  Form form{.block = Block::process, .basis = {}, .spec = {}};
  form.basis.emplace_back(Itself{});
  for (int j = 1; j <= order; ++j) {
    form.basis.emplace_back(Added<effects::LearnedFilter>{
        effects::LearnedFilter({1.0}, lags(time_constant_s, j), period_s)});
  }
  form.spec = [time_constant_s, order](const std::vector<double>& c) {
    EffectSpec spec{"learned", {}, {{"form", "dynamic"}}};
    const effects::LearnedFilter::Coefficients denominator = lags(time_constant_s, order);
    double through = 1.0 + c[0];
    for (int j = 1; j <= order; ++j) through -= c[static_cast<std::size_t>(j)];
    for (std::size_t k = 0; k <= static_cast<std::size_t>(order); ++k) {
      double numerator = through * denominator[k];
      for (int j = 1; j <= order; ++j) {
        numerator += c[static_cast<std::size_t>(j)] * lags(time_constant_s, order - j)[k];
      }
      spec.table.emplace_back(numerator, denominator[k]);
    }
    spec.options["description"] = text(
        "after a move of CO %.0f %% of the model's answer comes as in the model, the rest over "
        "about %.3g s; at "
        "rest it is %.0f %%",
        100.0 * through, 2.0 * time_constant_s * order, 100.0 * (1.0 + c[0]));
    return spec;
  };
  return form;
}

std::vector<Form> forms(const CheckedRecord& r) {
  const auto end = r.co.begin() + static_cast<std::ptrdiff_t>(r.training_end);
  const auto [low, high] = std::minmax_element(r.co.begin(), end);
  const double used = *high - *low;
  const double period_s = r.record.period_s;
  const double fitted_s = r.record.seconds_at(r.training_end);
  std::vector<Form> all;
  for (const int intervals : kIntervals) {
    all.push_back(static_form(knots(*low, *high, intervals)));
    all.push_back(gain_over_time(knots(0.0, fitted_s, intervals)));
  }
  for (const double part : {0.03, 0.06, 0.12, 0.25, 0.45}) {
    for (const int count : kPlayCounts) all.push_back(play_form(part * used, count));
  }
  const double slow_s = plant::answer_s(r.model);
  const double longest_s = std::min(20.0 * slow_s, 0.1 * fitted_s);
  for (double t = std::max(2.0 * period_s, 0.15 * slow_s); t < longest_s; t *= 1.5) {
    for (const int order : kLagOrders) all.push_back(lag_form(t, order, period_s));
  }
  return all;
}

// Least squares, from sums over blocks.
class Blocks {
 public:
  Blocks(const std::vector<std::vector<double>>& columns, const std::vector<double>& target,
         const std::vector<bool>& counts, std::size_t end)
      : size_(static_cast<Eigen::Index>(columns.size())) {
    for (std::size_t b = 0; b < kBlocks; ++b) {
      const std::size_t from = b * end / kBlocks;
      const std::size_t to = (b + 1) * end / kBlocks;
      Eigen::MatrixXd rows(static_cast<Eigen::Index>(to - from), size_);
      Eigen::VectorXd right(rows.rows());
      for (std::size_t k = from; k < to; ++k) {
        const auto row = static_cast<Eigen::Index>(k - from);
        right(row) = counts[k] ? target[k] : 0.0;
        for (Eigen::Index i = 0; i < size_; ++i) {
          rows(row, i) = counts[k] ? columns[static_cast<std::size_t>(i)][k] : 0.0;
        }
        if (counts[k]) samples_[b] += 1.0;
      }
      normal_[b] = rows.transpose() * rows;
      right_[b] = rows.transpose() * right;
      square_[b] = right.squaredNorm();
    }
  }

  // Fitted to all blocks but `left_out`; kBlocks: to all.
  Eigen::VectorXd solve(std::size_t left_out) const {
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(size_, size_);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(size_);
    for (std::size_t b = 0; b < kBlocks; ++b) {
      if (b == left_out) continue;
      normal += normal_[b];
      right += right_[b];
    }
    Eigen::VectorXd size = normal.diagonal().cwiseSqrt();
    for (Eigen::Index i = 0; i < size_; ++i) size(i) = size(i) > 0.0 ? 1.0 / size(i) : 0.0;
    Eigen::MatrixXd unit = size.asDiagonal() * normal * size.asDiagonal();
    unit.diagonal().setConstant(1.0 + kRidge);
    return size.asDiagonal() * unit.ldlt().solve(size.asDiagonal() * right);
  }

  // Sum of squares of what is left of a block when it is left out.
  double left_of(std::size_t block) const {
    const Eigen::VectorXd c = solve(block);
    return square_[block] - 2.0 * c.dot(right_[block]) + c.dot(normal_[block] * c);
  }
  double samples_of(std::size_t block) const noexcept { return samples_[block]; }

  // Mean square of what is left of the blocks when each is left out.
  double left() const {
    double sum = 0.0;
    double samples = 0.0;
    for (std::size_t b = 0; b < kBlocks; ++b) {
      sum += left_of(b);
      samples += samples_[b];
    }
    return sum / std::max(samples, 1.0);
  }

 private:
  Eigen::Index size_;
  std::array<double, kBlocks> samples_{};
  std::array<Eigen::MatrixXd, kBlocks> normal_;
  std::array<Eigen::VectorXd, kBlocks> right_;
  std::array<double, kBlocks> square_{};
};

}  // namespace

std::optional<Learned> learn(const FreeRun& run, const Fit& base, const CheckedRecord& record) {
  const std::size_t end = record.training_end;
  std::vector<std::vector<double>> columns;
  run.columns({}, base.point, columns);
  const double gain = base.solved.at(0);
  std::vector<double> target(end);
  for (std::size_t k = 0; k < end; ++k) {
    target[k] = record.pv[k] - run.offset()[k] - gain * columns[0][k];
  }
  // What is left are the past and the level, if that is not held at the model's.
  if (run.fits_level() && run.fitted_level(base.solved) == 0.0) columns.pop_back();
  columns.erase(columns.begin());
  const double noise = record.quality.noise_rms * record.quality.noise_rms;
  const Blocks alone(columns, target, record.training, end);
  const double without = alone.left();

  struct Tried {
    Form form;
    std::vector<std::vector<double>> columns;
    double left;
  };
  std::vector<Tried> tried;
  std::vector<Form> all_forms = forms(record);
  for (const Block block : {Block::valve, Block::process}) {
    if (block == Block::valve && !run.model().has_valve) continue;
    const std::vector<double> flow = run.flow(base.point, block);
    for (Form& form : all_forms) {
      if (form.block != block) continue;
      std::vector<std::vector<double>> all = columns;
      for (const effects::Effect& law : form.basis) {
        all.push_back(run.answer(base.point, block, law, flow));
        for (double& v : all.back()) v *= gain;
      }
      const double left = Blocks(all, target, record.training, end).left();
      if (std::isfinite(left)) tried.push_back({std::move(form), std::move(all), left});
    }
  }
  const auto least = std::min_element(
      tried.begin(), tried.end(), [](const Tried& a, const Tried& b) { return a.left < b.left; });
  if (least == tried.end()) return std::nullopt;
  const double enough = kAsGood * least->left + noise;
  const Tried* chosen = &*least;
  for (const Tried& t : tried) {
    if (t.left <= enough && t.form.basis.size() < chosen->form.basis.size()) chosen = &t;
  }
  const double closed = without > noise ? (without - chosen->left) / (without - noise) : 0.0;
  if (closed < kPartlyClosed) return std::nullopt;
  const Blocks fitted(chosen->columns, target, record.training, end);
  const Eigen::VectorXd c = fitted.solve(kBlocks);
  const auto past = static_cast<std::ptrdiff_t>(columns.size());
  Learned out{chosen->form.spec(std::vector<double>(c.data() + past, c.data() + c.size())),
              chosen->form.block, std::min(closed, 1.0)};
  for (std::size_t b = 0; b < kBlocks; ++b) {
    out.blocks.push_back({.range = {b * end / kBlocks, (b + 1) * end / kBlocks},
                          .samples = fitted.samples_of(b),
                          .model = alone.left_of(b),
                          .learned = fitted.left_of(b)});
  }
  return out;
}

bool ousts(const Learned& learned, const std::vector<double>& left_by_names,
           const std::vector<bool>& counts, double noise_rms) {
  std::size_t with_gap = 0;
  std::size_t better = 0;
  double gap = 0.0;
  double lead = 0.0;
  for (const LearnedBlock& block : learned.blocks) {
    double names = 0.0;
    for (std::size_t k = block.range.begin; k < block.range.end; ++k) {
      if (counts[k]) names += left_by_names[k] * left_by_names[k];
    }
    const double noise = noise_rms * noise_rms * block.samples;
    if (block.model < kGapFloors * kGapFloors * noise || !(block.model > noise)) continue;
    ++with_gap;
    gap += block.model - noise;
    lead += names - block.learned;
    if (names - block.learned >= kOusts * (block.model - noise)) ++better;
  }
  return with_gap > 0 && (lead >= kOusts * gap ||
                          static_cast<double>(better) >= kOustsOn * static_cast<double>(with_gap));
}

}  // namespace loopwarden::gap
