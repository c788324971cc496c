// SPDX-License-Identifier: Apache-2.0
#include "lab/diagnose_study/loop_logging.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace loopwarden::lab {

void compress(std::vector<double>& x, double deviation) {
  std::size_t kept = 0;
  double low_slope = -std::numeric_limits<double>::infinity();
  double high_slope = std::numeric_limits<double>::infinity();
  for (std::size_t k = 1; k < x.size(); ++k) {
    const double length = static_cast<double>(k - kept);
    low_slope = std::max(low_slope, (x[k] - deviation - x[kept]) / length);
    high_slope = std::min(high_slope, (x[k] + deviation - x[kept]) / length);
    if (low_slope <= high_slope && k + 1 < x.size()) continue;
    const std::size_t to = low_slope <= high_slope ? k : k - 1;
    if (to > kept) {
      for (std::size_t j = kept + 1; j < to; ++j) {
        const double share = static_cast<double>(j - kept) / static_cast<double>(to - kept);
        x[j] = x[kept] + share * (x[to] - x[kept]);
      }
      kept = to;
    }
    low_slope = -std::numeric_limits<double>::infinity();
    high_slope = std::numeric_limits<double>::infinity();
    if (kept < k) {
      low_slope = x[k] - deviation - x[kept];
      high_slope = x[k] + deviation - x[kept];
    }
  }
}

void hold_last(std::vector<double>& x, double dead_band) {
  for (std::size_t k = 1; k < x.size(); ++k) {
    if (std::abs(x[k] - x[k - 1]) <= dead_band) x[k] = x[k - 1];
  }
}

void round_to(std::vector<double>& x, double step) {
  if (step <= 0.0) return;
  for (double& v : x) v = std::round(v / step) * step;
}

std::vector<char> stale_samples(numeric::Random& random, std::size_t count, double share,
                                double mean_length) {
  std::vector<char> stale(count, 0);
  const double ends = 1.0 / mean_length;
  const double begins = ends * share / (1.0 - share);
  bool now = false;
  for (char& s : stale) {
    now = random.uniform() < (now ? 1.0 - ends : begins);
    s = now ? 1 : 0;
  }
  return stale;
}

void repeat_last(std::vector<double>& x, const std::vector<char>& stale) {
  for (std::size_t k = 1; k < x.size(); ++k) {
    if (stale[k] != 0) x[k] = x[k - 1];
  }
}

}  // namespace loopwarden::lab
