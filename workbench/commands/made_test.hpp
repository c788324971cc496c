// SPDX-License-Identifier: Apache-2.0
// Finds the move of a plan in the record of a loop that a person or another controller has moved.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "daemon/protocol/planned_test/planned_test.hpp"
#include "daemon/protocol/planned_test/test_plan_file.hpp"
#include "model/estimator/made_move.hpp"
#include "record/record_csv.hpp"
#include "workbench/files/output_files.hpp"

namespace loopwarden::workbench {

using protocol::TestPlanFile;
using protocol::TestRecord;

struct MadeTest {
  estimator::MadeMove move;
  TestRecord record;  // if the move was made: with `rest_s` before it
};
// The first move as planned, otherwise the newest move. Throws CommandError for a record without
// the moved signal.
MadeTest find_made_test(const TestPlanFile& plan, const std::vector<record::Record>& records,
                        double rest_s);

// Returns the records of a loop in order of time, from a record, any historian's export, or a
// folder of the recorder's segments. Of segments only rows between `from_s` and `to_s` are read,
// s since 1970. Throws RecordError, CommandError.
std::vector<record::Record> read_later_records(const std::filesystem::path& path,
                                               std::int64_t from_s, std::int64_t to_s,
                                               OutputFiles& files);

}  // namespace loopwarden::workbench
