// SPDX-License-Identifier: Apache-2.0
// The directory's thread: log-ins, and who has logged in once more every quarter of an hour.
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

// What the API asks. Any thread.
class LogIns {
 public:
  virtual ~LogIns() = default;
  // The answer, once there is one; not valid(): too many wait. `whose`: the client, who gets half of the room. `until`:
  // when the client no longer waits; then nothing more of it is done.
  virtual std::shared_future<Outcome> begin(const std::string& name, const std::string& password,
                                            const std::string& whose, Moment until) = 0;
};

class Worker final : public LogIns {
 public:
  // `users` and `sessions` outlive it. `again`: between looks at the groups of who has logged in.
  Worker(Server server, UserDirectory& users, Sessions& sessions,
         std::chrono::milliseconds again = std::chrono::minutes(15));
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;
  ~Worker() override { stop_for(std::chrono::milliseconds(0)); }
  // Nothing else is begun. False if what is being asked still goes on.
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
  // At who is due first.
  void look_again();
  // False: the directory did not say.
  bool look_at(const std::string& name);

  Server server_;
  UserDirectory& users_;
  Sessions& sessions_;
  std::chrono::milliseconds again_;
  // The thread's own.
  std::map<std::string, Moment> due_;  // who is looked at next, and when
  Moment next_;                        // look_again()
  std::string trouble_;                // that was logged last
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Job> jobs_;
  bool quit_ = false;
  base::Thread thread_;
};

}  // namespace loopwarden::page::ldap
