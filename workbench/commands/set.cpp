// SPDX-License-Identifier: Apache-2.0
// loopwarden set: an operator's hand on a running loop.
#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "base/text.hpp"
#include "config/diagnostic.hpp"
#include "workbench/command_line/command_line.hpp"
#include "workbench/live/daemon_client.hpp"
#include "workbench/live/loop_view.hpp"
#include "workbench/commands/subcommands.hpp"

namespace loopwarden::workbench {
namespace {

struct SetOptions {
  std::string socket;
  std::string loop;
  std::optional<double> set_point;
  std::optional<double> output;
  std::optional<std::string> mode;
  std::optional<std::string> jacket;
  bool json = false;
};

// Both words for a mode, in any case, as the daemon is told; empty if it is neither.
std::string mode_word(const std::string& word) {
  const std::string lower = base::lower_case(word);
  if (lower == "auto" || lower == "automatic") return "auto";
  if (lower == "man" || lower == "manual") return "man";
  return {};
}

nlohmann::json loop_of(DaemonClient& daemon, const std::string& name) {
  const nlohmann::json status = daemon.status();
  return status.at("loops")[loop_index(status, name)];
}

std::string summary(const nlohmann::json& loop) {
  const auto number = [&](const char* key) {
    return loop.contains(key) && loop[key].is_number()
               ? fmt::format("{:.4g}", loop[key].get<double>())
               : std::string("-");
  };
  return fmt::format(
      "mode {} (wanted {}), SP {} {}, CO {} {}, jacket {}{}", loop.value("mode", "-"),
      loop.value("requested_mode", "-"), number("sp"), loop.value("pv_unit", ""), number("co"),
      loop.value("co_unit", ""),
      loop.contains("jacket") ? loop["jacket"].value("form", "off") : "off",
      loop.contains("jacket") && loop["jacket"].value("acting", false) ? " acting" : "");
}

int run_set(const SetOptions& options) {
  nlohmann::json request = nlohmann::json::object();
  if (options.set_point) request["set_point"] = *options.set_point;
  if (options.output) request["output"] = *options.output;
  if (options.mode) request["mode"] = mode_word(*options.mode);
  if (options.jacket) request["jacket"] = *options.jacket;
  constexpr std::chrono::milliseconds kForDisk{1000};
  DaemonClient daemon(options.socket);
  const nlohmann::json before = loop_of(daemon, options.loop);
  bool on_disk = true;
  try {
    on_disk = daemon.set(options.loop, request, kForDisk);
  } catch (const DaemonRefused& e) {
    fmt::print(stderr, "loopwarden: {}: {}\n", options.loop, e.what());
    return kExitData;
  } catch (const OrderNotTaken& e) {
    fmt::print(stderr, "loopwarden: {}\n", e.what());
    return kExitTryAgain;
  }
  // The loop takes it over at its next cycle; the state printed must be from after that.
  const double sample_time_s = before.at("sample_time_s").get<double>();
  nlohmann::json after = before;
  for (int i = 0; i < 100 && after.value("period", 0ULL) < before.value("period", 0ULL) + 2; ++i) {
    std::this_thread::sleep_for(std::chrono::duration<double>(std::min(sample_time_s, 0.1)));
    after = loop_of(daemon, options.loop);
  }
  if (options.json) {
    const nlohmann::json result = {
        {"loop", options.loop}, {"before", before}, {"after", after}, {"on_disk", on_disk}};
    fmt::print("{}\n", result.dump(2));
    return kExitOk;
  }
  fmt::print("{}: before: {}\n{:{}}  after:  {}\n", options.loop, summary(before), "",
             options.loop.size(), summary(after));
  if (!on_disk) fmt::print(stderr, "loopwarden: done, but the journal does not have it yet\n");
  return kExitOk;
}

}  // namespace

void add_set(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<SetOptions>();
  CLI::App* sub = app.add_subcommand("set", "set point, mode, output or jacket of a running loop");
  sub->add_option("loop", options->loop, "tag of the loop")->required();
  add_socket_option(*sub, options->socket);
  auto* sp = sub->add_option("--sp", options->set_point, "set point, PV units");
  auto* out = sub->add_option("--output", options->output, "output in manual, CO units");
  auto* mode = sub->add_option("--mode", options->mode, "auto (automatic) or man (manual)")
                   ->check([](const std::string& word) {
                     return mode_word(word).empty()
                                ? "is auto or man (got '" + config::quotable(word) + "')"
                                : std::string();
                   });
  auto* jacket = sub->add_option("--jacket", options->jacket, "off, shadow or on")
                     ->check(CLI::IsMember({"off", "shadow", "on"}));
  add_json_flag(*sub, options->json);
  sub->footer(
      "What is ordered together takes effect in one cycle, mode first. An order that can't act is\n"
      "refused with exit code 65: an output in automatic, a set point that follows PV in manual,\n"
      "a value beyond its limits.\n"
      "Example: loopwarden set FIC-101 --mode man --output 30");
  sub->callback([=, &exit_code] {
    if (sp->empty() && out->empty() && mode->empty() && jacket->empty()) {
      throw CLI::RequiredError("one of --sp, --output, --mode, --jacket");
    }
    exit_code = run_set(*options);
  });
}

}  // namespace loopwarden::workbench
