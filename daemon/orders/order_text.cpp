// SPDX-License-Identifier: Apache-2.0
#include "daemon/orders/order_text.hpp"

#include <fmt/format.h>

namespace loopwarden::daemon::orders {

std::string why_refused(rt::Refusal refusal, const rt::Order& order,
                        const rt::LoopSettings& settings) {
  const auto limits = [](const char* what, double low, double high, double got) {
    return fmt::format("{} must be within {:g} to {:g} (got {:.9g})", what, low, high, got);
  };
  const control::ControllerSettings& controller = settings.controller;
  if (refusal == rt::Refusal::set_point_out_of_limits && order.set_point) {
    return limits("set point", controller.set_point.low, controller.set_point.high,
                  *order.set_point);
  }
  if (refusal == rt::Refusal::output_out_of_limits && order.output) {
    return limits("output", controller.output.low, controller.output.high, *order.output);
  }
  return rt::to_text(refusal);
}

}  // namespace loopwarden::daemon::orders
