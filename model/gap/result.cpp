// SPDX-License-Identifier: Apache-2.0
#include "model/gap/result.hpp"

#include "model/numeric/enum_name.hpp"

namespace loopwarden::gap {

const char* to_text(Outcome outcome) noexcept {
  return numeric::enum_name<Outcome::unexplained>(outcome,
                                                  {"missing_effect", "no_gap", "unexplained"});
}

const char* to_text(LooksLike what) noexcept {
  return numeric::enum_name<LooksLike::nothing_known>(
      what, {"a disturbance", "the valve", "the process", "the controller", "compression",
             "nothing known"});
}

const char* to_text(LocatedBy by) noexcept {
  return numeric::enum_name<LocatedBy::condition>(by, {"block", "time", "condition"});
}

}  // namespace loopwarden::gap
