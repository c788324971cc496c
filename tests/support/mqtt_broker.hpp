// SPDX-License-Identifier: Apache-2.0
// A Mosquitto on a free port for one test, and a broker that accepts and is silent.
#pragma once

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <thread>

#include "tests/support/free_port.hpp"
#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests {

inline bool port_answers(int port) {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in peer{};
  peer.sin_family = AF_INET;
  peer.sin_port = htons(static_cast<std::uint16_t>(port));
  peer.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const bool connected = ::connect(fd, reinterpret_cast<const sockaddr*>(&peer), sizeof peer) == 0;
  ::close(fd);
  return connected;
}

class MqttBroker {
 public:
  // `more`: lines of mosquitto.conf. Without them every client has full access.
  explicit MqttBroker(const std::string& more = "allow_anonymous true\n") : port_(free_port()) {
    // As root it would switch to the user mosquitto, who can't read the test's files.
    write_file(folder_ / "mosquitto.conf",
               "per_listener_settings false\nuser root\npersistence false\nlog_dest stderr\n"
               "listener " +
                   std::to_string(port_) + " 127.0.0.1\n" + more);
    start();
  }
  MqttBroker(const MqttBroker&) = delete;
  MqttBroker& operator=(const MqttBroker&) = delete;
  ~MqttBroker() { kill(); }

  void start() {
    child_ = ::fork();
    if (child_ < 0) throw std::runtime_error("no process for mosquitto");
    if (child_ == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      const int log = ::open((folder_ / "log").c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
      ::dup2(log, STDERR_FILENO);
      const std::string file = (folder_ / "mosquitto.conf").string();
      ::execl("/usr/sbin/mosquitto", "mosquitto", "-c", file.c_str(), nullptr);
      ::_exit(127);
    }
    for (int i = 0; i < 1000 && !port_answers(port_); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    if (!port_answers(port_))
      throw std::runtime_error("no mosquitto: " + read_file(folder_ / "log"));
  }
  void kill() {
    if (child_ <= 0) return;
    ::kill(child_, SIGKILL);
    ::waitpid(child_, nullptr, 0);
    child_ = -1;
  }
  // Its operating system still accepts connections.
  void hang() const { ::kill(child_, SIGSTOP); }
  void go_on() const { ::kill(child_, SIGCONT); }

  int port() const { return port_; }

 private:
  TemporaryFolder folder_;
  int port_;
  pid_t child_ = -1;
};

// Accepts connections and bytes, and never answers.
class SilentBroker {
 public:
  SilentBroker() : port_(free_port()), fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in own{};
    own.sin_family = AF_INET;
    own.sin_port = htons(static_cast<std::uint16_t>(port_));
    own.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int yes = 1;
    ::setsockopt(fd_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    REQUIRE(::bind(fd_, reinterpret_cast<const sockaddr*>(&own), sizeof own) == 0);
    REQUIRE(::listen(fd_, 8) == 0);
  }
  SilentBroker(const SilentBroker&) = delete;
  SilentBroker& operator=(const SilentBroker&) = delete;
  ~SilentBroker() { ::close(fd_); }
  int port() const { return port_; }
  int fd() const { return fd_; }  // listens

 private:
  int port_;
  int fd_;
};

// An authority, a server's and a client's certificate signed by it, and another authority that
// signed neither.
class Certificates {
 public:
  Certificates() {
    const std::string in = "cd " + folder_.path().string() + " && ";
    const auto make = [&](const std::string& line) {
      REQUIRE(run(in + line + " 2>&1").exit_code == 0);
    };
    for (const std::string authority : {"ca", "other"}) {
      make(
          "openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj "
          "/CN=" +
          authority + " -keyout " + authority + ".key -out " + authority + ".crt");
    }
    for (const std::string name : {"server", "client"}) {
      make("openssl req -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -subj /CN=" + name +
           " -keyout " + name + ".key -out " + name + ".csr");
      write_file(folder_ / "extensions", "subjectAltName=IP:127.0.0.1\n");
      make("openssl x509 -req -in " + name +
           ".csr -CA ca.crt -CAkey ca.key -CAcreateserial -days 2 -extfile " + "extensions -out " +
           name + ".crt");
    }
  }
  std::string file(const std::string& name) const { return (folder_ / name).string(); }
  // Lines of mosquitto.conf for a broker that admits only clients with a certificate by the
  // authority.
  std::string broker_lines() const {
    return "cafile " + file("ca.crt") + "\ncertfile " + file("server.crt") + "\nkeyfile " +
           file("server.key") + "\nrequire_certificate true\nallow_anonymous true\n";
  }

 private:
  TemporaryFolder folder_;
};

}  // namespace loopwarden::tests
