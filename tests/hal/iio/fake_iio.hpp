// SPDX-License-Identifier: Apache-2.0
// A directory tree that looks like /sys/bus/iio/devices.
#pragma once

#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>

#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests {

class FakeIio {
 public:
  const std::filesystem::path& root() const { return folder_.path(); }
  std::filesystem::path device(int number) const {
    return folder_.path() / ("iio:device" + std::to_string(number));
  }
  void set(int number, std::string_view file, std::string_view text) const {
    write_file(device(number) / file, text);
  }
  // Overwrites an existing file in place. The driver of a sysfs file changes its value the same
  // way: a reader never finds it empty.
  void change(int number, std::string_view file, std::string_view text) const {
    const std::string name = (device(number) / file).string();
    std::FILE* stream = std::fopen(name.c_str(), "r+");
    if (stream == nullptr) throw std::runtime_error("no " + name);
    std::fwrite(text.data(), 1, text.size(), stream);
    std::fputc('\n', stream);
    std::fclose(stream);
  }
  // Returns the first line, as a converter would read it.
  std::string get(int number, std::string_view file) const {
    const std::string text = read_file(device(number) / file);
    return text.substr(0, text.find('\n'));
  }
  void remove(int number) const { std::filesystem::remove_all(device(number)); }

  // A 12-bit converter of 0 to 20.475 mA, 5 uA per step, with one input and one output channel.
  void add_board(int number, std::string_view name) const {
    set(number, "name", std::string(name) + "\n");
    set(number, "in_current0_raw", "2400\n");
    set(number, "in_current_scale", "0.005\n");
    set(number, "out_current0_raw", "0\n");
    set(number, "out_current_scale", "0.005\n");
  }

 private:
  TemporaryFolder folder_;
};

}  // namespace loopwarden::tests
