// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <string_view>
#include <system_error>

#include "lab/hidden_cases/hidden_case.hpp"

namespace loopwarden::hidden_cases {
namespace {

void write_text(const std::filesystem::path& path, std::string_view text) {
  std::ofstream stream(path, std::ios::binary | std::ios::trunc);
  stream << text;
  if (!stream.flush()) {
    throw std::filesystem::filesystem_error("can't write", path,
                                            std::make_error_code(std::errc::io_error));
  }
}

std::string record_csv(const LoopRecord& record) {
  std::string text = "time,sp,pv,co\n";
  for (std::size_t k = record.first; k < record.pv.size(); ++k) {
    fmt::format_to(std::back_inserter(text), "{:.6g},{:.6g},{:.6g},{:.6g}\n", record.time_s[k],
                   record.sp[k], record.pv[k], record.co[k]);
  }
  return text;
}

std::string model_yaml(const BelievedLoop& believed) {
  return fmt::format(
      "# simulation of the loop as its engineers believe it to be\n"
      "sample_time: 0.1          # s\n"
      "controller:\n"
      "  kp: {:.6g}\n"
      "  ki: {:.6g}                # 1/s\n"
      "  output: [0, 10]\n"
      "  anti_windup: integral_clamp   # integral held within +-10, then the sum within the output "
      "range\n"
      "valve:\n"
      "  effects: []\n"
      "process:\n"
      "  gain: {:.6g}\n"
      "  time_constant: {:.6g}     # s\n"
      "  dead_time: {:.6g}         # s\n"
      "  uncertainty: {{gain: 0.03, time_constant: 0.06, dead_time: 0.03}}   # relative\n"
      "transmitter:\n"
      "  range: [0, 10]           # L/min\n"
      "  resolution: 0.00244140625\n",
      believed.tuning.kp, believed.tuning.ki_per_s, believed.gain, believed.time_constant_s,
      believed.dead_time_s);
}

}  // namespace

void write_case(const std::filesystem::path& folder, const HiddenCase& one) {
  const std::filesystem::path place = folder / one.id;
  std::filesystem::create_directories(place);
  write_text(place / "record.csv", record_csv(one.record));
  write_text(place / "model.yaml", model_yaml(one.believed));
}

void write_truth(const std::filesystem::path& folder, const std::vector<HiddenCase>& cases) {
  nlohmann::json all = nlohmann::json::array();
  for (const HiddenCase& one : cases) {
    all.push_back({{"id", one.id},
                   {"effect", one.effect},
                   {"accept", one.accept},
                   {"par", one.parameters},
                   {"note", one.note},
                   {"from_s", one.from_s},
                   {"floor_rmse", one.floor_rmse}});
  }
  write_text(folder / "truth.json", all.dump(1) + "\n");
}

void write_cases(const std::filesystem::path& folder, const std::vector<CaseRequest>& requests) {
  std::filesystem::create_directories(folder);
  std::vector<HiddenCase> made;
  for (const CaseRequest& request : requests) {
    made.push_back(make_case(request));
    write_case(folder, made.back());
    // Frees the record, because only the truth is needed later.
    made.back().record = {};
  }
  write_truth(folder, made);
}

}  // namespace loopwarden::hidden_cases
