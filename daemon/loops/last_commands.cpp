// SPDX-License-Identifier: Apache-2.0
#include "daemon/loops/last_commands.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <system_error>

#include "base/digest/digest.hpp"
#include "base/file.hpp"

namespace loopwarden::daemon {
namespace {

using control::Mode;
using nlohmann::json;

constexpr int kVersion = 1;
constexpr std::size_t kChecksumLine = 9;  // eight digits and a line end
constexpr std::size_t kMostBytes = std::size_t{16} << 20U;

std::string checksum_line(std::string_view text) {
  return fmt::format("{:08x}\n", base::crc32(text));
}

double finite(const json& number) {
  const auto value = number.get<double>();
  if (!std::isfinite(value)) throw std::runtime_error("a number is not finite");
  return value;
}

LastCommand command_of(const json& j) {
  const auto mode = j.at("mode").get<std::string>();
  if (mode != "automatic" && mode != "manual") throw std::runtime_error("no mode " + mode);
  const json& range = j.at("pv_range");
  return {.mode = mode == "automatic" ? Mode::automatic : Mode::manual,
          .set_point = finite(j.at("set_point")),
          .pv_unit = j.at("pv_unit").get<std::string>(),
          .pv_range = {finite(range.at(0)), finite(range.at(1))},
          .commissioned = j.at("commissioned").get<bool>(),
          .manual_after_fault = j.at("manual_after_fault").get<bool>()};
}

}  // namespace

std::string text_of(const std::map<std::string, LastCommand>& loops) {
  json all = json::object();
  for (const auto& [tag, command] : loops) {
    all[tag] = {{"mode", command.mode == Mode::automatic ? "automatic" : "manual"},
                {"set_point", command.set_point},
                {"pv_unit", command.pv_unit},
                {"pv_range", {command.pv_range.first, command.pv_range.second}},
                {"commissioned", command.commissioned},
                {"manual_after_fault", command.manual_after_fault}};
  }
  const std::string body = json{{"version", kVersion}, {"loops", std::move(all)}}.dump(
                               -1, ' ', false, json::error_handler_t::replace) +
                           "\n";
  return checksum_line(body) + body;
}

std::map<std::string, LastCommand> read_last_orders(std::string_view text) {
  if (text.size() < kChecksumLine) throw std::runtime_error("it is truncated");
  const std::string_view body = text.substr(kChecksumLine);
  if (text.substr(0, kChecksumLine) != checksum_line(body)) {
    throw std::runtime_error("its checksum is wrong");
  }
  const json j = json::parse(body);
  const int version = j.at("version").get<int>();
  if (version != kVersion) {
    throw std::runtime_error(
        fmt::format("it has version {}, this daemon reads version {}", version, kVersion));
  }
  std::map<std::string, LastCommand> loops;
  for (const auto& [tag, command] : j.at("loops").items()) loops[tag] = command_of(command);
  return loops;
}

LastCommands LastCommandsFile::load() const {
  LastCommands commands;
  const std::optional<std::string> text = base::read_file(path_, kMostBytes);
  if (!text && errno == ENOENT) return commands;
  try {
    if (!text) throw std::runtime_error(base::error_text(errno));
    commands.loops = read_last_orders(*text);
    commands.known = true;
  } catch (const std::exception& e) {
    commands.damaged = fmt::format("{}: {}", path_.string(), e.what());
    std::error_code ignored;
    std::filesystem::rename(path_, path_.string() + ".damaged", ignored);
  }
  return commands;
}

std::string LastCommandsFile::save(const std::map<std::string, LastCommand>& loops) const {
  const std::optional<base::FileError> error = base::replace_file(path_, text_of(loops));
  return error ? error->text() : std::string();
}

}  // namespace loopwarden::daemon
