// SPDX-License-Identifier: Apache-2.0
// The error of a free run against PV, and the share of it that a correction removes.
//
//   gap closed = (before^2 - after^2)/(before^2 - floor^2), -1 to 1
#pragma once

#include <cstddef>
#include <vector>

#include "model/gap/result.hpp"

namespace loopwarden::twin {

// Over the used samples; `fitted` of them count as the training part.
gap::Misfit error_left(const std::vector<double>& pv, const std::vector<double>& run,
                       const std::vector<bool>& used, std::size_t fitted, double floor);
// NaN if `before` is below two floors.
double gap_closed(double before_rmse, double after_rmse, double floor_rmse) noexcept;

}  // namespace loopwarden::twin
