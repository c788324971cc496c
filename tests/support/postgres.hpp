// SPDX-License-Identifier: Apache-2.0
// A PostgreSQL server for one test, in a temporary folder.
#pragma once

#include <pwd.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fcntl.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <pqxx/pqxx>

#include "tests/support/device/foreign_process.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests {

class Postgres {
 public:
  // Returns the folder of the newest installed version, or an empty path.
  static std::filesystem::path programs() {
    std::filesystem::path newest;
    std::error_code none;
    for (const auto& version : std::filesystem::directory_iterator("/usr/lib/postgresql", none)) {
      if (std::filesystem::exists(version.path() / "bin/initdb") && version.path() > newest) {
        newest = version.path();
      }
    }
    return newest.empty() ? newest : newest / "bin";
  }

  Postgres() : port_(free_port()) {
    std::filesystem::permissions(folder_.path(), std::filesystem::perms(0755));
    std::filesystem::create_directory(data());
    // It refuses to run as root.
    if (const passwd* user = ::getuid() == 0 ? ::getpwnam("postgres") : nullptr) {
      uid_ = user->pw_uid;
      gid_ = user->pw_gid;
      if (::chown(data().c_str(), uid_, gid_) != 0) throw std::runtime_error("chown");
    }
    std::filesystem::permissions(data(), std::filesystem::perms(0700));
    run({"initdb", "-D", data().string(), "-A", "trust", "-U", "postgres", "-E", "UTF8",
         "--locale=C.UTF-8", "--no-sync"});
    std::ofstream(data() / "postgresql.conf", std::ios::app)
        << "port = " << port_ << "\nlisten_addresses = '127.0.0.1'\nunix_socket_directories = '"
        << data().string() << "'\n";
    start();
    pqxx::connection connection(url("postgres"));
    pqxx::nontransaction(connection).exec("CREATE DATABASE fleet");
  }
  Postgres(const Postgres&) = delete;
  Postgres& operator=(const Postgres&) = delete;
  ~Postgres() { stop(SIGQUIT); }

  void start() {
    server_ = spawn({"postgres", "-D", data().string()});
    if (!test::eventually([&] { return answers(); }, std::chrono::seconds(60))) {
      throw std::runtime_error("PostgreSQL does not answer: " + read_file(folder_ / "log"));
    }
  }
  // SIGQUIT: stops at once, without a message to its clients.
  void stop(int signal = SIGQUIT) {
    if (server_ < 0) return;
    ::kill(server_, signal);
    ::waitpid(server_, nullptr, 0);
    server_ = -1;
  }

  std::string url(const std::string& name = "fleet") const {
    return "postgresql://postgres@127.0.0.1:" + std::to_string(port_) + "/" + name;
  }
  // Returns the first field of the first row as text, or "" without a row.
  std::string ask(const std::string& sql) const {
    pqxx::connection connection(url());
    const pqxx::result result = pqxx::nontransaction(connection).exec(sql);
    return result.empty() || result[0][0].is_null() ? "" : result[0][0].as<std::string>();
  }
  // Like ask(), but also returns "" if the table does not exist yet.
  std::string ask_or_nothing(const std::string& sql) const {
    try {
      return ask(sql);
    } catch (const std::exception&) {
      return "";
    }
  }

 private:
  std::filesystem::path data() const { return folder_ / "data"; }
  bool answers() const {
    try {
      return pqxx::connection(url("postgres")).is_open();
    } catch (const pqxx::failure&) {
      return false;
    }
  }
  void run(const std::vector<std::string>& words) {
    int status = 0;
    ::waitpid(spawn(words), &status, 0);
    if (status != 0) throw std::runtime_error(words[0] + ": " + read_file(folder_ / "log"));
  }
  pid_t spawn(std::vector<std::string> words) {
    words[0] = (programs() / words[0]).string();
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    const std::string log = (folder_ / "log").string();
    const pid_t child = ::fork();
    if (child < 0) throw std::runtime_error("no process for PostgreSQL");
    if (child == 0) {
      const int file = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
      ::dup2(file, STDOUT_FILENO);
      ::dup2(file, STDERR_FILENO);
      if (uid_ != 0 && (::setgid(gid_) != 0 || ::setuid(uid_) != 0)) ::_exit(126);
      ::prctl(PR_SET_PDEATHSIG, SIGQUIT);
      ::execv(argv[0], argv.data());
      ::_exit(127);
    }
    return child;
  }

  TemporaryFolder folder_;
  int port_;
  uid_t uid_ = 0;
  gid_t gid_ = 0;
  pid_t server_ = -1;
};

}  // namespace loopwarden::tests
