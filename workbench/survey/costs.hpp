// SPDX-License-Identifier: Apache-2.0
// The assumptions from which the work list estimates minutes and savings. A site replaces them with
// --costs FILE (docs/reference/worklist.md lists every key).
//
//   saving per year = removed share * (swing of PV in % of its span * loss of the loop's kind
//                     + full strokes per year * cost of an overhaul / strokes between overhauls)
//
// Each factor is a range, so the saving is one too. A known cost per hour of a loop replaces the
// first product.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>

#include "config/diagnostic.hpp"
#include "config/key_reference.hpp"

namespace loopwarden::workbench {

using Range = std::pair<double, double>;

enum class Work : std::uint8_t { repair, test, tune, upstream, transmitter, look };
inline constexpr std::array kWorks{Work::repair,   Work::test,        Work::tune,
                                   Work::upstream, Work::transmitter, Work::look};

struct WorkCost {
  Work work;
  const char* key;     // in the file
  const char* action;  // next step of survey.json
  std::string who;
  bool shutdown = false;
  double minutes = 0.0;
  Range removes;  // share of the loss
};

struct KindCost {
  const char* kind;
  Range loss;  // currency per year and % of the PV span
};

struct Costs {
  std::string source = "defaults";  // or the file
  std::string currency = "EUR";
  double hours_per_year = 8000.0;
  std::array<KindCost, 5> kinds{{{"flow", {100.0, 1000.0}},
                                 {"pressure", {200.0, 2000.0}},
                                 {"level", {0.0, 300.0}},
                                 {"temperature", {300.0, 3000.0}},
                                 {"unknown", {50.0, 1000.0}}}};
  double overhaul = 4000.0;               // currency
  Range strokes{100'000.0, 1'000'000.0};  // full strokes between two overhauls
  std::array<WorkCost, 6> works{
      {{Work::repair, "repair", "repair", "technician", true, 240.0, {0.5, 0.9}},
       {Work::test, "test", "test the valve", "technician", false, 30.0, {0.3, 0.9}},
       {Work::tune, "tune", "tune", "control engineer", false, 120.0, {0.4, 0.8}},
       {Work::upstream,
        "look_upstream",
        "look upstream",
        "control engineer",
        false,
        60.0,
        {0.2, 0.8}},
       {Work::transmitter,
        "transmitter",
        "check the transmitter",
        "technician",
        false,
        60.0,
        {0.2, 0.9}},
       {Work::look, "look_closer", "look closer", "operator", false, 30.0, {0.0, 0.8}}}};

  const WorkCost& of(Work work) const { return works[static_cast<std::size_t>(work)]; }
  Range loss_of(std::string_view kind) const;
};

config::Loaded<Costs> read_costs_text(const std::string& file, std::string_view text);
// Prints the file's messages. Throws CommandError with the known keys if the file can't be used.
Costs read_costs_file(const std::filesystem::path& path);
config::KeyReference describe_costs();

}  // namespace loopwarden::workbench
