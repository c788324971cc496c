// SPDX-License-Identifier: Apache-2.0
// The receipt of work at a loop: the records before and after a repair (model/diagnosis/repair.hpp)
// or another change, or new gains (model/analysis/gain_comparison.hpp).
#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "model/diagnosis/repair.hpp"
#include "model/plant/loop_model.hpp"
#include "record/import/importer.hpp"
#include "workbench/survey/costs.hpp"

namespace loopwarden::workbench {

struct ReceiptInput {
  std::string tag{};
  std::string found{};              // by the technician; empty: not reported
  std::string worked_at{};          // UTC; empty: unknown
  bool gains_only = false;          // the work was a change of the gains
  std::vector<std::string> work{};  // as the journal has it, oldest first
  // At least one record each, in the order of time.
  std::vector<record::Imported> before{}, after{};
  std::vector<double> co_range{};                       // CO units
  std::optional<std::pair<double, double>> pv_range{};  // PV units
  std::string kind{"unknown"};
  std::optional<plant::LoopModel> model{};
  std::optional<std::array<control::PidGains, 2>> gains{};  // before and after a change of them
  Costs costs{};
};

struct Receipt {
  nlohmann::json told;  // docs/how-to/prove-a-repair.md
  std::string picture;  // SVG elements of both records, for the page
};

// Throws CommandError if a side has no record that can be judged.
Receipt make_receipt(ReceiptInput input);

// Returns "FIC-205: repaired. The record after the work excludes half of the effect."
std::string receipt_sentence(const nlohmann::json& receipt);
std::string receipt_text(const nlohmann::json& receipt);
// Returns a self-contained page of one sheet A4.
std::string receipt_page(const Receipt& receipt);

}  // namespace loopwarden::workbench
