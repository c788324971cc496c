// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/population.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "model/estimator/constants.hpp"
#include "model/numeric/random.hpp"

namespace loopwarden::estimator {
namespace {

using numeric::Random;

constexpr int kMostDegrees = 60;
constexpr int kHalvings = 40;
constexpr double kUphill = 1e9;       // degree at which only better places are taken
constexpr double kBetterError = 4.0;  // nats, for a new search with other sizes of the error

// Folds a number back into [0, 1].
double reflect(double v) noexcept {
  v = std::fmod(std::abs(v), 2.0);
  return v > 1.0 ? 2.0 - v : v;
}

std::size_t below(Random& random, std::size_t count) noexcept {
  return std::min(count - 1,
                  static_cast<std::size_t>(random.uniform() * static_cast<double>(count)));
}

std::vector<double> draw(const Start& start, std::size_t size, Random& random) {
  std::vector<double> z(size);
  const bool near = random.uniform() < start.share;
  for (std::size_t i = 0; i < size; ++i) {
    z[i] = random.uniform();
    if (near) z[i] = reflect(start.mean[i] + start.deviation[i] * random.normal());
  }
  return z;
}

class Search {
 public:
  Search(const Likelihood& likelihood, const Hypothesis& hypothesis, const Effort& effort,
         Random& random, Likelihood::Work& work)
      : likelihood_(likelihood),
        hypothesis_(hypothesis),
        effort_(effort),
        random_(random),
        work_(work) {}

  Population run(const Start& start) {
    const std::size_t size = hypothesis_.layout().size;
    for (std::size_t i = 0; i < effort_.members * effort_.first; ++i) {
      std::vector<double> z = draw(start, size, random_);
      const double l = likelihood_.of(hypothesis_, z, work_);
      members_.push_back({std::move(z), l});
      if (l > best_.log_likelihood) best_ = members_.back();
    }
    double degree = 0.0;
    for (int i = 0; i < kMostDegrees && degree < 1.0; ++i) {
      degree = i + 1 == kMostDegrees ? 1.0 : next_degree(degree, i == 0);
      for (int move = 0; move < effort_.moves; ++move) move_all(degree, move);
    }
    Population out{members_, 0};
    for (std::size_t i = 1; i < out.members.size(); ++i) {
      if (out.members[i].log_likelihood > out.top().log_likelihood) out.best = i;
    }
    // A needle in the likelihood can be met early and lost at a low degree.
    if (best_.log_likelihood > out.top().log_likelihood) out.members[out.best] = best_;
    climb(out.members[out.best]);
    return out;
  }

 private:
  // Raises the degree by as much as keeps enough members effective, and draws the members again.
  double next_degree(double degree, bool first) {
    double top = members_[0].log_likelihood;
    for (const Member& m : members_) top = std::max(top, m.log_likelihood);
    const auto count = static_cast<double>(members_.size());
    const double wanted = first ? std::min(0.5 * static_cast<double>(effort_.members), 0.3 * count)
                                : kLimits.kept * count;
    std::vector<double> weights(members_.size());
    const auto effective = [&](double by) {
      double sum = 0.0;
      double squares = 0.0;
      for (std::size_t i = 0; i < members_.size(); ++i) {
        weights[i] = std::exp(by * (members_[i].log_likelihood - top));
        sum += weights[i];
        squares += weights[i] * weights[i];
      }
      return sum * sum / squares;
    };
    double by = 1.0 - degree;
    if (effective(by) < wanted) {
      double low = 0.0;
      double high = by;
      for (int i = 0; i < kHalvings; ++i) {
        const double middle = 0.5 * (low + high);
        (effective(middle) < wanted ? high : low) = middle;
      }
      by = std::max(low, 1e-9);
      effective(by);
    }
    double sum = 0.0;
    for (const double w : weights) sum += w;
    std::vector<Member> next;
    const double offset = random_.uniform();
    double passed = 0.0;
    std::size_t i = 0;
    for (std::size_t k = 0; k < effort_.members; ++k) {
      const double at = (static_cast<double>(k) + offset) / static_cast<double>(effort_.members);
      while (i + 1 < members_.size() && passed + weights[i] / sum < at)
        passed += weights[i++] / sum;
      next.push_back(members_[i]);
    }
    members_ = std::move(next);
    return std::min(1.0, degree + by);
  }

  // Covariance of the members, as a factor.
  Eigen::MatrixXd spread() const {
    const auto size = static_cast<Eigen::Index>(hypothesis_.layout().size);
    Eigen::VectorXd mean = Eigen::VectorXd::Zero(size);
    for (const Member& m : members_) {
      mean += Eigen::Map<const Eigen::VectorXd>(m.z.data(), size);
    }
    mean /= static_cast<double>(members_.size());
    Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(size, size);
    for (const Member& m : members_) {
      const Eigen::VectorXd d = Eigen::Map<const Eigen::VectorXd>(m.z.data(), size) - mean;
      covariance.noalias() += d * d.transpose() / static_cast<double>(members_.size());
    }
    covariance.diagonal().array() += 1e-10;
    return covariance.llt().matrixL();
  }

  // Random steps uphill. Hypotheses compete by their best likelihood, from which the best of few
  // members is some nats away, by chance.
  void climb(Member& best) {
    constexpr double kLonger = 1.5, kShorter = 0.93, kShortest = 0.01;
    const Eigen::MatrixXd factor = spread();
    const auto size = static_cast<Eigen::Index>(hypothesis_.layout().size);
    double scale = 0.3;
    for (std::size_t step = 0; step < effort_.climbs; ++step) {
      Eigen::VectorXd normal(size);
      for (Eigen::Index i = 0; i < size; ++i) normal(i) = random_.normal();
      // Every other step along one coordinate.
      const auto only = static_cast<Eigen::Index>(below(random_, best.z.size()));
      const Eigen::VectorXd move = factor * normal;
      std::vector<double> z = best.z;
      for (Eigen::Index i = 0; i < size; ++i) {
        if (step % 2 == 1 && i != only) continue;
        double& at = z[static_cast<std::size_t>(i)];
        at = reflect(at + scale * move(i));
      }
      if (moves_to(best, std::move(z), kUphill)) {
        scale *= kLonger;
        moves_to(best, other_error(best.z), kUphill);
      } else {
        scale = std::max(kShortest, scale * kShorter);
      }
    }
  }

  void move_all(double degree, int round) {
    constexpr std::array<double, 3> kScales{1.0, 0.4, 0.12};
    const auto size = static_cast<Eigen::Index>(hypothesis_.layout().size);
    const Eigen::MatrixXd factor = spread();
    for (Member& m : members_) {
      std::vector<double> z = m.z;
      const std::size_t kind = below(random_, 5);
      if (kind == 4 && hypothesis_.has_valve() && below(random_, 2) == 0) {
        redraw_actuator(z);
      } else if (kind < 2) {
        Eigen::VectorXd normal(size);
        for (Eigen::Index i = 0; i < size; ++i) normal(i) = random_.normal();
        const double scale = 2.38 / std::sqrt(static_cast<double>(size)) *
                             kScales[(static_cast<std::size_t>(round) + kind) % kScales.size()];
        const Eigen::VectorXd move = factor * normal;
        for (std::size_t i = 0; i < z.size(); ++i) {
          z[i] = reflect(z[i] + scale * move(static_cast<Eigen::Index>(i)));
        }
      } else {
        const Member& a = members_[below(random_, members_.size())];
        const Member& b = members_[below(random_, members_.size())];
        const double scale = kind == 2 ? 0.6 : 1.0;
        for (std::size_t i = 0; i < z.size(); ++i) {
          z[i] = reflect(z[i] + scale * (a.z[i] - b.z[i]) + 1e-4 * random_.normal());
        }
      }
      // Other sizes of the error at the new place cost no further free run.
      if (moves_to(m, std::move(z), degree)) moves_to(m, other_error(m.z), degree);
    }
  }

  bool moves_to(Member& m, std::vector<double> z, double degree) {
    const double l = likelihood_.of(hypothesis_, z, work_);
    if (l > best_.log_likelihood) best_ = {z, l};
    if (std::log(random_.uniform()) >= degree * (l - m.log_likelihood)) return false;
    m.z = std::move(z);
    m.log_likelihood = l;
    return true;
  }

  std::vector<double> other_error(std::vector<double> z) {
    const Layout& layout = hypothesis_.layout();
    if (random_.uniform() < 0.5) {
      z[layout.error] = random_.uniform();
      z[layout.error + 1] = random_.uniform();
    } else {
      z[layout.error] = reflect(z[layout.error] + 0.18 * random_.normal());
      z[layout.error + 1] = reflect(z[layout.error + 1] + 0.12 * random_.normal());
    }
    if (hypothesis_.jumps() && random_.uniform() < 0.3) z[layout.jitter] = random_.uniform();
    return z;
  }

  void redraw_actuator(std::vector<double>& z) {
    const Layout& layout = hypothesis_.layout();
    z[layout.actuator] = random_.uniform();
    z[layout.actuator + 1] = random_.uniform();
    if (random_.uniform() < 0.5) z[layout.actuator + 2] = random_.uniform();
  }

  const Likelihood& likelihood_;
  const Hypothesis& hypothesis_;
  const Effort& effort_;
  Random& random_;
  Likelihood::Work& work_;
  std::vector<Member> members_;
  Member best_{{}, std::numeric_limits<double>::lowest()};  // of all that were tried
};

}  // namespace

Member with_best_error(const Likelihood& likelihood, const Hypothesis& hypothesis, Member member,
                       Likelihood::Work& work) {
  member.log_likelihood = likelihood.of(hypothesis, member.z, work);
  const std::size_t error = hypothesis.layout().error;
  const std::array<double, 2> step{1.0 / static_cast<double>(likelihood.errors().disturbances()),
                                   1.0 / static_cast<double>(likelihood.errors().laws())};
  for (bool moved = true; moved;) {
    moved = false;
    for (std::size_t i = 0; i < 2; ++i) {
      for (const double way : {-step[i], step[i]}) {
        std::vector<double> z = member.z;
        z[error + i] += way;
        if (z[error + i] < 0.0 || z[error + i] > 1.0) continue;
        const double l = likelihood.of(hypothesis, z, work);
        if (l <= member.log_likelihood + 0.01) continue;
        member = {std::move(z), l};
        moved = true;
      }
    }
  }
  return member;
}

Start Start::around(const std::vector<Member>& members, std::size_t best, double wider,
                    double least, double share) {
  const std::size_t size = members[best].z.size();
  Start out{members[best].z, std::vector<double>(size, 0.0), share};
  std::vector<double> mean(size, 0.0);
  const auto count = static_cast<double>(members.size());
  for (const Member& m : members) {
    for (std::size_t i = 0; i < size; ++i) mean[i] += m.z[i] / count;
  }
  for (std::size_t i = 0; i < size; ++i) {
    double square = 0.0;
    for (const Member& m : members) square += (m.z[i] - mean[i]) * (m.z[i] - mean[i]) / count;
    out.deviation[i] = wider * std::sqrt(square) + least;
  }
  return out;
}

Population search(const Likelihood& likelihood, const Hypothesis& hypothesis, const Start& start,
                  const Effort& effort, std::uint64_t seed, Likelihood::Work& work) {
  Random random(seed);
  Population found = Search(likelihood, hypothesis, effort, random, work).run(start);
  for (int round = 0; round < 2; ++round) {
    Member better = with_best_error(likelihood, hypothesis, found.top(), work);
    if (better.log_likelihood < found.top().log_likelihood + kBetterError) break;
    Start again = Start::around(found.members, found.best, 2.0, 0.03, 0.85);
    again.mean = better.z;
    const Layout& layout = hypothesis.layout();
    again.deviation[layout.error] = again.deviation[layout.error + 1] = 0.15;
    if (hypothesis.has_valve()) {
      for (std::size_t i = 0; i < 3; ++i) {
        again.deviation[layout.actuator + i] = std::max(again.deviation[layout.actuator + i], 0.15);
      }
    }
    Population next = Search(likelihood, hypothesis, effort, random, work).run(again);
    if (next.top().log_likelihood <= better.log_likelihood) {
      next.members[next.best] = better;
    }
    if (next.top().log_likelihood <= found.top().log_likelihood) break;
    found = std::move(next);
  }
  return found;
}

}  // namespace loopwarden::estimator
