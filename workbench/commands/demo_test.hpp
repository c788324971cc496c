// SPDX-License-Identifier: Apache-2.0
// The scene of ./demo with a test that decides: a record that two explanations fit, the proposed
// test, the move on the simulated plant, and the decision.
#pragma once

#include <functional>
#include <string>

namespace loopwarden::workbench {

// `model_file`: the plant with its fault. It is explained with the same model without the fault.
// `say` receives the lines. Throws CommandError.
void show_test_scene(const std::string& model_file,
                     const std::function<void(const std::string&)>& say);

}  // namespace loopwarden::workbench
