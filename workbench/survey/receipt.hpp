// SPDX-License-Identifier: Apache-2.0
// The receipt of work at a valve: the loop before and after, and whether the effect is gone
// (model/diagnosis/repair.hpp).
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "model/diagnosis/repair.hpp"
#include "record/import/importer.hpp"
#include "workbench/survey/costs.hpp"

namespace loopwarden::workbench {

struct ReceiptInput {
  std::string tag{};
  std::string found{};      // by the technician; empty: not reported
  std::string worked_at{};  // UTC; empty: unknown
  // At least one record each, in the order of time.
  std::vector<record::Imported> before{}, after{};
  std::vector<double> co_range{};                       // CO units
  std::optional<std::pair<double, double>> pv_range{};  // PV units
  std::string kind{"unknown"};
  Costs costs{};
};

struct Receipt {
  nlohmann::json told;  // docs/reference/receipt.md
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
