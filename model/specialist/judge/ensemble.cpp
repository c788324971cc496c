// SPDX-License-Identifier: Apache-2.0
#include "model/specialist/judge/ensemble.hpp"

#include <algorithm>
#include <cmath>

// Uses the wider registers if the processor has them; the choice is made at the start of the
// program. Sums keep their order and no multiply-add is fused, so both give the same bits.
// Sanitizers do not run before that choice is made.
#if defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && \
    !defined(__clang__)
#define LOOPWARDEN_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define LOOPWARDEN_WIDE
#endif

namespace loopwarden::specialist {
namespace {

constexpr std::size_t kWidth = 32;

// out = W in + b, rows of kWidth columns.
LOOPWARDEN_WIDE void multiply(const float* weights, const float* bias, const float* in, float* out,
                              std::size_t inputs, std::size_t outputs) {
  for (std::size_t o = 0; o < outputs; ++o) {
    float sum[kWidth];
    for (std::size_t c = 0; c < kWidth; ++c) sum[c] = bias[o];
    for (std::size_t i = 0; i < inputs; ++i) {
      const float w = weights[o * inputs + i];
      const float* const row = in + i * kWidth;
      for (std::size_t c = 0; c < kWidth; ++c) sum[c] += w * row[c];
    }
    for (std::size_t c = 0; c < kWidth; ++c) out[o * kWidth + c] = sum[c];
  }
}

// Rational approximation of tanh, within 4 units in the last place (the coefficients are those of
// Eigen's ptanh, Mozilla Public License 2.0; beyond the clamp tanh is 1 in single precision).
LOOPWARDEN_WIDE void tansig(float* values, std::size_t count) {
  for (std::size_t k = 0; k < count; ++k) {
    const float x = std::min(std::max(values[k], -7.90531110763549805F), 7.90531110763549805F);
    const float s = x * x;
    float p = s * -2.76076847742355e-16F + 2.00018790482477e-13F;
    p = s * p + -8.60467152213735e-11F;
    p = s * p + 5.12229709037114e-08F;
    p = s * p + 1.48572235717979e-05F;
    p = s * p + 6.37261928875436e-04F;
    p = s * p + 4.89352455891786e-03F;
    float q = s * 1.19825839466702e-06F + 1.18534705686654e-04F;
    q = s * q + 2.26843463243900e-03F;
    q = s * q + 4.89352518554385e-03F;
    values[k] = x * p / q;
  }
}

LOOPWARDEN_WIDE double square_distance(const float* a, const float* b, std::size_t rows) {
  double sum = 0.0;
  for (std::size_t r = 0; r < rows; ++r) {
    float row[kWidth];
    for (std::size_t c = 0; c < kWidth; ++c) {
      const float d = a[r * kWidth + c] - b[r * kWidth + c];
      row[c] = d * d;
    }
    float part = 0.0F;
    for (std::size_t c = 0; c < kSide; ++c) part += row[c];
    sum += static_cast<double>(part);
  }
  return sum;
}

// Row r, column c of the matrix to place r kWidth + c.
void spread(std::span<const double> pv, const Scaling& scaling, float* rows) noexcept {
  const double factor = 1.0 / scaling.half_span;
  for (std::size_t c = 0; c < kSide; ++c) {
    for (std::size_t r = 0; r < kSide; ++r) {
      rows[r * kWidth + c] = static_cast<float>((pv[c * kSide + r] - scaling.centre) * factor);
    }
  }
}

}  // namespace

SignatureEnsemble::SignatureEnsemble(const std::vector<SignatureSpecialist>& specialists) {
  std::size_t widest = kSide;
  for (const SignatureSpecialist& s : specialists) {
    Compiled compiled;
    compiled.scaling = s.scaling;
    for (std::size_t i = 0; i < 3; ++i) {
      const Layer& from = s.network.layers[i];
      CompiledLayer& to = compiled.layers[i];
      to.inputs = static_cast<std::size_t>(from.weights.cols());
      to.outputs = static_cast<std::size_t>(from.weights.rows());
      widest = std::max(widest, to.outputs);
      for (Eigen::Index r = 0; r < from.weights.rows(); ++r) {
        to.bias.push_back(static_cast<float>(from.bias(r)));
        for (Eigen::Index c = 0; c < from.weights.cols(); ++c) {
          to.weights.push_back(static_cast<float>(from.weights(r, c)));
        }
      }
    }
    compiled.target.resize(kSide * kColumns);
    spread(s.target, s.scaling, compiled.target.data());
    specialists_.push_back(std::move(compiled));
  }
  for (auto& rows : activity_) rows.resize(widest * kColumns);
  errors_.resize(specialists_.size());
}

std::span<const double> SignatureEnsemble::errors(std::span<const double> pv) noexcept {
  const Scaling* scaled = nullptr;
  for (std::size_t i = 0; i < specialists_.size(); ++i) {
    const Compiled& s = specialists_[i];
    if (scaled == nullptr || *scaled != s.scaling) {
      spread(pv, s.scaling, activity_[0].data());
      scaled = &s.scaling;
    }
    for (std::size_t l = 0; l < 3; ++l) {
      const CompiledLayer& layer = s.layers[l];
      multiply(layer.weights.data(), layer.bias.data(), activity_[l].data(),
               activity_[l + 1].data(), layer.inputs, layer.outputs);
      if (l < 2) tansig(activity_[l + 1].data(), layer.outputs * kColumns);
    }
    const double square = square_distance(activity_[3].data(), s.target.data(), kSide);
    errors_[i] = square * s.scaling.half_span * s.scaling.half_span / kSignatureSamples;
  }
  return errors_;
}

std::optional<std::size_t> SignatureEnsemble::verdict(std::span<const double> pv) noexcept {
  const std::span<const double> all = errors(pv);
  std::optional<std::size_t> best;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (std::isfinite(all[i]) && (!best || all[i] < all[*best])) best = i;
  }
  return best;
}

}  // namespace loopwarden::specialist
