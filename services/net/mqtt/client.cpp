// SPDX-License-Identifier: Apache-2.0
#include "services/net/mqtt/client.hpp"

#include <fmt/format.h>
#include <mosquitto.h>

#include <cerrno>
#include <iterator>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace loopwarden::mqtt {
namespace {

// Longest sleep of the network thread. libmosquitto checks keep-alive between two sleeps.
constexpr int kLoopMs = 500;
constexpr std::chrono::seconds kGoodbye{2};  // longest wait for confirmations

struct Library {
  Library() { mosquitto_lib_init(); }
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;
  ~Library() { mosquitto_lib_cleanup(); }
};

void demand(int result, const char* what) {
  if (result == MOSQ_ERR_SUCCESS) return;
  // Errors of the system have their own text.
  const std::string why = result == MOSQ_ERR_ERRNO ? std::generic_category().message(errno)
                                                   : mosquitto_strerror(result);
  throw std::runtime_error(fmt::format("{}: {}", what, why));
}

const char* text_or_null(const std::string& text) { return text.empty() ? nullptr : text.c_str(); }

// Refuses a pass phrase: the library would ask for it on a terminal.
int no_pass_phrase(char*, int, int, void*) { return 0; }

}  // namespace

Client::Client(ClientSettings settings)
    : settings_(std::move(settings)),
      back_off_{.first = settings_.reconnect_min, .longest = settings_.reconnect_max} {
  static const Library library;
  // TLS needs more stack than the daemon's other threads.
  thread_.start({.name = "lw-mqtt", .stack_bytes = 1024UL * 1024UL}, [this] { run(); });
}

Client::~Client() {
  base::ask_to_end(mutex_, quit_, changed_);
  thread_.join();
}

void Client::connect(std::optional<Message> will) {
  {
    const std::lock_guard lock(mutex_);
    wanted_ = true;
    will_ = std::move(will);
  }
  changed_.notify_all();
}

void Client::leave() {
  {
    const std::lock_guard lock(handle_mutex_);
    if (handle_ == nullptr) return;
    leaving_ = true;
    connected_ = false;
    leave_by_ = Clock::now() + kGoodbye;
  }
  say_goodbye();
}

bool Client::publish(const Message& message) {
  const std::lock_guard lock(handle_mutex_);
  if (handle_ == nullptr || !connected() || waiting() >= settings_.most_waiting) return false;
  waiting_.fetch_add(1, std::memory_order_relaxed);
  const int result = mosquitto_publish(
      handle_, nullptr, message.topic.c_str(), static_cast<int>(message.payload.size()),
      message.payload.data(), static_cast<int>(message.qos), message.retain);
  if (result != MOSQ_ERR_SUCCESS) waiting_.fetch_sub(1, std::memory_order_relaxed);
  return result == MOSQ_ERR_SUCCESS;
}

std::vector<Event> Client::events(std::chrono::milliseconds patience) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, patience, [this] { return !events_.empty(); });
  std::vector<Event> taken(std::make_move_iterator(events_.begin()),
                           std::make_move_iterator(events_.end()));
  events_.clear();
  lock.unlock();
  changed_.notify_all();
  return taken;
}

void Client::push(Event event) {
  std::unique_lock lock(mutex_);
  // Limits the queue: a sender that is faster than the user's fetching waits in the network,
  // finally at the broker.
  changed_.wait(lock, [this] { return quit_ || events_.size() < settings_.most_events; });
  events_.push_back(std::move(event));
  lock.unlock();
  changed_.notify_all();
}

// --- network thread ---

void Client::run() {
  while (wait_for_attempt()) {
    const Clock::time_point start = Clock::now();
    attempt();
    // A connection that breaks at once counts as a failure. An example is another client that uses
    // the same name.
    if (leaving_.exchange(false) || Clock::now() - start > back_off_.longest) failures_ = 0;
  }
}

// Waits until the next attempt is due. Returns false when the client ends.
bool Client::wait_for_attempt() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return quit_ || wanted_; });
  if (!first_) {
    const double chance = std::uniform_real_distribution<double>(0.0, 1.0)(random_);
    changed_.wait_for(lock, back_off_.pause(++failures_, chance), [this] { return quit_; });
  }
  first_ = false;
  wanted_ = false;
  return !quit_;
}

void Client::attempt() {
  std::optional<Message> will;
  {
    const std::lock_guard lock(mutex_);
    will = std::move(will_);
  }
  std::string why;
  try {
    open(will);
    why = serve();
  } catch (const std::exception& e) {
    why = e.what();
  }
  close();
  push({.kind = Event::Kind::disconnected, .message = {}, .why = std::move(why)});
}

void Client::open(const std::optional<Message>& will) {
  why_.clear();
  ungranted_ = 0;
  {
    const std::lock_guard lock(handle_mutex_);
    // A new handle per connection. The user must publish again what an old connection did not
    // deliver.
    handle_ = mosquitto_new(settings_.client_id.c_str(), true, this);
    if (handle_ == nullptr) throw std::runtime_error("can't create an MQTT client");
    set_up(will);
  }
  demand(mosquitto_connect_async(handle_, settings_.broker.host.c_str(), settings_.broker.port,
                                 static_cast<int>(settings_.keep_alive.count())),
         to_text(settings_.broker).c_str());
}

void Client::set_up(const std::optional<Message>& will) {
  demand(mosquitto_threaded_set(handle_, true), "threads");
  mosquitto_connect_callback_set(handle_, [](mosquitto*, void* client, int code) {
    static_cast<Client*>(client)->on_connack(code);
  });
  mosquitto_publish_callback_set(handle_, [](mosquitto*, void* client, int) {
    static_cast<Client*>(client)->waiting_.fetch_sub(1, std::memory_order_relaxed);
  });
  mosquitto_subscribe_callback_set(
      handle_, [](mosquitto*, void* client, int, int count, const int* granted) {
        static_cast<Client*>(client)->on_suback(count == 1 ? granted[0] : 0x80);
      });
  mosquitto_message_callback_set(handle_,
                                 [](mosquitto*, void* client, const mosquitto_message* message) {
                                   static_cast<Client*>(client)->on_message(*message);
                                 });
  if (!settings_.user.empty()) {
    const std::string password = settings_.password.given() ? read_secret(settings_.password) : "";
    demand(mosquitto_username_pw_set(handle_, settings_.user.c_str(), text_or_null(password)),
           "user and password");
  }
  if (settings_.broker.tls) secure();
  if (will) {
    demand(mosquitto_will_set(handle_, will->topic.c_str(), static_cast<int>(will->payload.size()),
                              will->payload.data(), static_cast<int>(will->qos), will->retain),
           "will");
  }
}

void Client::secure() {
  if (settings_.ca_file.empty()) {
    demand(mosquitto_int_option(handle_, MOSQ_OPT_TLS_USE_OS_CERTS, 1), "the system's authorities");
  }
  if (!settings_.ca_file.empty() || !settings_.certificate_file.empty()) {
    const std::string key = settings_.key.given() ? path_of(settings_.key).string() : "";
    demand(mosquitto_tls_set(handle_, text_or_null(settings_.ca_file), nullptr,
                             text_or_null(settings_.certificate_file), text_or_null(key),
                             no_pass_phrase),
           "TLS files");
  }
}

// Serves the connection until it ends. Returns the reason.
std::string Client::serve() {
  for (;;) {
    const int result = mosquitto_loop(handle_, kLoopMs, 1);
    if (leaving_) say_goodbye();
    if (leaving_ && result != MOSQ_ERR_SUCCESS) return "left";
    if (!why_.empty()) return why_;
    if (result == MOSQ_ERR_ERRNO) return std::generic_category().message(errno);
    if (result != MOSQ_ERR_SUCCESS) return mosquitto_strerror(result);
    const std::lock_guard lock(mutex_);
    if (quit_) return "ended";
  }
}

void Client::say_goodbye() {
  const std::lock_guard lock(handle_mutex_);
  if (goodbye_said_ || (waiting() > 0 && Clock::now() < leave_by_)) return;
  goodbye_said_ = mosquitto_disconnect(handle_) == MOSQ_ERR_SUCCESS;
}

void Client::close() {
  const std::lock_guard lock(handle_mutex_);
  connected_ = false;
  goodbye_said_ = false;
  mosquitto_destroy(handle_);
  handle_ = nullptr;
  waiting_ = 0;
}

void Client::on_connack(int code) {
  if (code != 0) {
    why_ = mosquitto_connack_string(code);
    return;
  }
  ungranted_ = settings_.subscriptions.size();
  for (const Subscription& wanted : settings_.subscriptions) {
    mosquitto_subscribe(handle_, nullptr, wanted.filter.c_str(), static_cast<int>(wanted.qos));
  }
  if (ungranted_ == 0) on_suback(0);
}

void Client::on_suback(int most_granted) {
  if (most_granted > 2) {
    why_ = "the broker refuses a subscription";
    return;
  }
  if (ungranted_ > 0 && --ungranted_ > 0) return;
  connected_ = true;
  push({.kind = Event::Kind::connected, .message = {}, .why = {}});
}

void Client::on_message(const mosquitto_message& message) {
  const auto* bytes = static_cast<const char*>(message.payload);
  push({.kind = Event::Kind::message,
        .message = {.topic = message.topic,
                    .payload = std::string(bytes, bytes + message.payloadlen),
                    .qos = message.qos == 0 ? Qos::at_most_once : Qos::at_least_once,
                    .retain = message.retain},
        .why = {}});
}

}  // namespace loopwarden::mqtt
