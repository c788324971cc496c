// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "base/child_process.hpp"
#include "base/file.hpp"
#include "workbench/setup/setup.hpp"

namespace loopwarden::workbench::setup {

// Runs `loopwardend --probe` as a child process. The child ends after one minute without a request
// and is restarted by the next request.
class ProbeProcess final : public Prober {
 public:
  explicit ProbeProcess(std::filesystem::path folder) : folder_(std::move(folder)) {}
  // Throws CommandError if the program can't be started or does not answer.
  protocol::Probed read(const protocol::Probe& asked) override;

 private:
  void start();
  std::string exchange(const std::string& line);

  std::filesystem::path folder_;
  std::unique_ptr<base::ChildProcess> child_;
  base::File to_;
  std::string received_;
};

// Returns the path of loopwardend: next to this program, in the folder of the package, or in PATH.
std::string daemon_program();

}  // namespace loopwarden::workbench::setup
