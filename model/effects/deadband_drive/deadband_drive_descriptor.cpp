// SPDX-License-Identifier: Apache-2.0
#include "model/effects/deadband_drive/deadband_drive.hpp"

#include "model/effects/descriptor.hpp"

namespace loopwarden::effects::deadband_drive {
namespace {

// Returns the share of the samples at which the drive is still moving. Without such samples the
// effect is only a band.
double on_its_way(Candidate::Values v, Candidate::Values co, double period_s) {
  if (co.empty()) return 0.0;
  DeadbandDrive drive(v[0], v[1], period_s);
  drive.reset(co.front());
  std::size_t moving = 0;
  for (const double u : co) {
    drive.step(u);
    if (drive.moves()) ++moving;
  }
  return static_cast<double>(moving) / static_cast<double>(co.size());
}

void candidates(const SearchContext& c, std::vector<Candidate>& all) {
  all.push_back({.smooth = false,
                 .parameters = 2,
                 .prior_nats = 2.0,  // electric drives are rarer than pneumatic ones
                 .search = {{"band", 0.002 * c.span(), 0.2 * c.span(), true, 8},
                            {"rate", 0.002 * c.span(), 0.5 * c.span(), true, 8},
                            kStart},
                 .starts = 4,
                 .more_from = 0.005 * c.span(),
                 .resting_half_band = [](Candidate::Values v) { return v[0]; },
                 .telling = on_its_way,
                 .friction = true});
}

}  // namespace

Descriptor describe() {
  return {.number = 31,
          .name = "deadband_drive",
          .blocks = {Block::valve},
          .parameters = {at_least_zero("band", "CO units",
                                       "the command must be so far away before the drive moves"),
                         above_zero("rate", "CO units/s", "of the drive, until it is there")},
          .header = "deadband_drive/deadband_drive.hpp",
          .make = [](const SpecReader& read, const EffectContext& context) -> Effect {
            return DeadbandDrive(read.value("band"), read.value("rate"), context.sample_time_s);
          },
          .candidates = candidates,
          .valve_rank = 2,
          .made_of = {"low_air_supply", "stiction"},
          .more_by = "band",
          .resting_band = [](const SpecReader& read) { return read.value("band"); },
          .alarms = {"unknown"},
          .examples = {{"deadband_drive",
                        {"deadband_drive", {{"band", 0.6}, {"rate", 0.3}}},
                        Block::valve}}};
}

}  // namespace loopwarden::effects::deadband_drive
