// SPDX-License-Identifier: Apache-2.0
// Set point, output, mode and gains: the only handlers that move a valve.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>

#include "daemon/protocol/ask.hpp"
#include "services/page/api/body.hpp"
#include "services/page/api/handlers.hpp"
#include "services/page/api/tags.hpp"

namespace loopwarden::page::api {
namespace {

using nlohmann::json;

struct Wish {
  std::string what;  // set_point, output or mode
  json value;
  std::optional<json> old;  // what the page showed, null: not known
};

void check_value(const std::string& what, const json& value, const char* name) {
  const bool sound = what == "mode" ? value == "automatic" || value == "manual"
                                    : value.is_number() && std::isfinite(value.get<double>());
  if (!sound) {
    throw ApiError(
        400, what == "mode" ? "expected \"automatic\" or \"manual\"" : "expected a number", name);
  }
}

bool same(const json& a, const json& b) {
  if (!a.is_number() || !b.is_number()) return a == b;
  return a.get<double>() == b.get<double>();
}

Wish wish_of(const http::Request& request, const std::string& tag) {
  const json body = object_of(request, {"set", "confirm"});
  if (!body.contains("set") || !body.contains("confirm")) {
    throw ApiError(400, "a body has set and confirm");
  }
  check_keys(body["set"], "set", {"set_point", "output", "mode"});
  check_keys(body["confirm"], "confirm", {"tag", "old", "new"});
  if (body["set"].size() != 1) throw ApiError(400, "one value is set at a time", "set");
  const auto wanted = body["set"].begin();
  Wish wish{wanted.key(), wanted.value(), {}};
  if (body["confirm"].contains("old")) wish.old = body["confirm"]["old"];
  check_value(wish.what, wish.value, "set");
  if (wish.old && !wish.old->is_null()) check_value(wish.what, *wish.old, "confirm.old");
  if (body["confirm"].value("tag", json()) != tag) {
    throw ApiError(400, "the confirmation is for another loop", "confirm.tag");
  }
  if (!same(body["confirm"].value("new", json()), wish.value)) {
    throw ApiError(400, "the confirmation is for another value", "confirm.new");
  }
  return wish;
}

// `to`: a request, or the values that it expects.
template <class To>
void put(const std::string& what, const json& value, To& to) {
  if (what == "mode") {
    to.mode = value.get<std::string>();
  } else {
    const double number = value.is_null() ? protocol::kNone : value.get<double>();
    (what == "output" ? to.output : to.set_point) = number;
  }
}

http::Response changed_meanwhile(const json& told) {
  http::Response response =
      json_response({{"error", told.at("why")}, {"now", *told.at("now").begin()}});
  response.status = 409;
  return response;
}

// Polls a command until the loop's cycle has taken it and the journal's line is on the disk. The
// cycle of a slow loop takes seconds or minutes. No thread is blocked between two polls.
class Outcome {
 public:
  Outcome(Context& context, std::string tag, const protocol::OrderTaken& sent)
      : context_(&context),
        tag_(std::move(tag)),
        order_(sent.order),
        patience_(5.0 + 3.0 * sent.sample_time_s) {}

  http::Response look() const {
    const json now = context_->orders.ask(protocol::OrderRequest{tag_, order_});
    return is_over(protocol::read_answer<protocol::OrderState>(now)) ? answer_of(now) : later();
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kFirstPause{40};
  static constexpr std::chrono::milliseconds kLongestPause{1000};
  static constexpr std::chrono::milliseconds kForDisk{1000};

  // Returns a pause that grows with the waiting time: page.sock limits the lines per second, and
  // acknowledgements need some of them.
  std::chrono::milliseconds pause() const {
    const auto waited =
        std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now() - begun_);
    return std::clamp(waited / 8, kFirstPause, kLongestPause);
  }

  bool is_over(const protocol::OrderState& now) const {
    const auto waited = Clock::now() - begun_;
    if (now.state == "done") {
      return (now.outcome && now.outcome->on_disk) || waited > kForDisk;
    }
    return now.state == "refused" || waited > patience_;
  }

  static http::Response answer_of(const json& told) {
    const bool changed = told.contains("now") && told["now"].is_object() && !told["now"].empty();
    return changed ? changed_meanwhile(told) : json_response(told);
  }

  http::Response later() const {
    http::Response response;
    response.delay = pause();
    response.next = [outcome = *this] { return outcome.look(); };
    return response;
  }

  Context* context_;
  std::string tag_;
  std::uint64_t order_;
  std::chrono::duration<double> patience_;
  Clock::time_point begun_ = Clock::now();
};

protocol::Gains gains_at(const json& object, const char* key) {
  if (!object.contains(key)) throw ApiError(400, "expected kp, ki and kd", key);
  const json& gains = object[key];
  check_keys(gains, key, {"kp", "ki", "kd"});
  const auto number = [&](const char* name) {
    const bool sound =
        gains.contains(name) && gains[name].is_number() && std::isfinite(gains[name].get<double>());
    if (!sound) throw ApiError(400, "expected a number", std::string(key) + "." + name);
    return gains[name].get<double>();
  };
  return {number("kp"), number("ki"), number("kd")};
}

}  // namespace

void check_may_tune(const BoxState& state, const protocol::LoopDescription& loop) {
  if (!state.about.page.tuning) {
    throw ApiError(403,
                   "loopwardend.yaml has no page: {tuning: true}, so the page can't set gains");
  }
  if (loop.control == "elsewhere") {
    throw ApiError(403, "another controller has this loop, and its gains");
  }
}

http::Response order(Context& context, const Call& call) {
  const auto state = context.now().state;
  const protocol::LoopDescription& loop = loop_at(state, call.request.part(2));
  if (!context.settings.control) throw ApiError(403, "page.yaml has no control: true");
  if (!state->about.page.control) {
    throw ApiError(403,
                   "loopwardend.yaml has no page: {control: true}, so the page can't set values");
  }
  const Wish wish = wish_of(call.request, loop.tag);
  protocol::SetRequest request{
      .loop = loop.tag, .user = call.who.user, .address = call.request.peer};
  put(wish.what, wish.value, request);
  // The command is not compared with an unknown old value, because the loop has not run yet. The
  // output is an exception: until the first command the loop itself may not know it.
  if (wish.old && (!wish.old->is_null() || wish.what == "output")) {
    put(wish.what, *wish.old, request.expect.emplace());
  }
  return Outcome(context, loop.tag, ask(context.orders, request)).look();
}

http::Response tune(Context& context, const Call& call) {
  const auto state = context.now().state;
  const protocol::LoopDescription& loop = loop_at(state, call.request.part(2));
  if (!context.settings.control) throw ApiError(403, "page.yaml has no control: true");
  check_may_tune(*state, loop);
  const json body = object_of(call.request, {"set", "confirm"});
  const protocol::Gains wanted = gains_at(body, "set");
  if (!body.contains("confirm")) throw ApiError(400, "a body has set and confirm");
  const json& confirm = body["confirm"];
  check_keys(confirm, "confirm", {"tag", "old", "new"});
  if (confirm.value("tag", json()) != loop.tag) {
    throw ApiError(400, "the confirmation is for another loop", "confirm.tag");
  }
  if (json(gains_at(confirm, "new")) != json(wanted)) {
    throw ApiError(400, "the confirmation is for other gains", "confirm.new");
  }
  const protocol::TuneRequest request{.loop = loop.tag,
                                      .kp = wanted.kp,
                                      .ki = wanted.ki,
                                      .kd = wanted.kd,
                                      .expect = gains_at(confirm, "old"),
                                      .user = call.who.user,
                                      .address = call.request.peer};
  return Outcome(context, loop.tag, ask(context.orders, request)).look();
}

}  // namespace loopwarden::page::api
