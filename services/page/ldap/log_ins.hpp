// SPDX-License-Identifier: Apache-2.0
// The directory's thread: handles log-ins, and checks logged-in users again every 15 minutes.
#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <future>
#include <map>
#include <mutex>
#include <string>

#include "base/thread.hpp"
#include "services/page/ldap/ldap_server.hpp"
#include "services/page/users/sessions.hpp"
#include "services/page/users/user_file.hpp"

namespace loopwarden::page::ldap {

// The interface for the API. Any thread.
class LogIns {
 public:
  virtual ~LogIns() = default;
  // Starts a log-in. The result is not valid() if too many wait. `whose`: the client, who may use
  // half of the queue. `until`: the time at which the client stops waiting; the log-in is then
  // dropped.
  virtual std::shared_future<Outcome> begin(const std::string& name, const std::string& password,
                                            const std::string& whose, Moment until) = 0;
};

class Worker final : public LogIns {
 public:
  // `users` and `sessions` outlive it. `again`: time between two checks of a user's groups.
  Worker(Server server, UserDirectory& users, Sessions& sessions,
         std::chrono::milliseconds again = std::chrono::minutes(15));
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;
  ~Worker() override { stop_for(std::chrono::milliseconds(0)); }
  // Starts no further checks. Returns false if a check is still running after `patience`.
  bool stop_for(std::chrono::milliseconds patience);

  std::shared_future<Outcome> begin(const std::string& name, const std::string& password,
                                    const std::string& whose, Moment until) override;

 private:
  struct Job {
    std::string name;
    std::string password;
    std::string whose;
    Moment until;
    std::promise<Outcome> answer;
  };
  void run();
  void answer(Job job);
  // Checks the user who is due first.
  void look_again();
  // Returns false if the directory gave no answer.
  bool look_at(const std::string& name);

  Server server_;
  UserDirectory& users_;
  Sessions& sessions_;
  std::chrono::milliseconds again_;
  // Used only by the thread.
  std::map<std::string, Moment> due_;  // next check of each user
  Moment next_;                        // look_again()
  std::string trouble_;                // last logged one
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> jobs_;
  bool quit_ = false;
  base::Thread thread_;
};

}  // namespace loopwarden::page::ldap
