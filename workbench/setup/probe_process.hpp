// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "base/child_process.hpp"
#include "base/file.hpp"
#include "workbench/setup/setup.hpp"

namespace loopwarden::workbench::setup {

// `loopwardend --probe` as a child: it ends by itself when nothing is asked for a minute, and is started again then.
class ProbeProcess final : public Prober {
 public:
  explicit ProbeProcess(std::filesystem::path folder) : folder_(std::move(folder)) {}
  // Throws CommandError where the program can't be started or does not answer.
  protocol::Probed read(const protocol::Probe& asked) override;

 private:
  void start();
  std::string exchange(const std::string& line);

  std::filesystem::path folder_;
  std::unique_ptr<base::ChildProcess> child_;
  base::File to_;
  std::string received_;
};

// loopwardend beside this program, where the package has it, or where PATH has it.
std::string daemon_program();

}  // namespace loopwarden::workbench::setup
