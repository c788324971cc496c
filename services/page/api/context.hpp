// SPDX-License-Identifier: Apache-2.0
// The objects that the handlers use. Several threads use each of them.
#pragma once

#include <functional>
#include <stdexcept>
#include <string>

#include "services/page/api/host_names.hpp"
#include "services/page/boxes/box.hpp"
#include "daemon/protocol/daemon_client.hpp"
#include "services/page/files/report_store.hpp"
#include "services/page/history/history.hpp"
#include "services/page/ldap/log_ins.hpp"
#include "services/page/fleet/fleet.hpp"
#include "services/page/planned_test/test_runner.hpp"
#include "services/net/http/assets.hpp"
#include "services/net/http/message.hpp"
#include "services/net/http/server.hpp"
#include "services/page/settings/page_settings.hpp"
#include "services/page/users/log_in_guard.hpp"
#include "services/page/users/sessions.hpp"
#include "services/page/users/user_file.hpp"

namespace loopwarden::page::api {

struct Context {
  const PageSettings& settings;
  const HostNames& hosts;
  std::function<Box::Now()> now;
  std::function<std::string()> sparklines;
  protocol::Daemon& daemon;  // status.sock
  protocol::Daemon& orders;  // page.sock
  UserDirectory& users;
  Sessions& sessions;
  LogInGuard& guard;
  ldap::LogIns* ldap;  // null: not configured in page.yaml
  history::History& history;
  files::ReportStore& reports;
  planned_test::TestRunner& tests;
  fleet::Fleet* fleet;  // null: not configured in page.yaml
  std::function<http::Response(const http::Request&)> site;
  std::function<http::Counters()> counters;
};

// A request on its way to a handler, with the identity of its sender.
struct Call {
  const http::Request& request;
  Identity who;
};

// Ends a handler. The answer is {"error": what, "field": field}.
class ApiError : public std::runtime_error {
 public:
  ApiError(int status, const std::string& what, std::string field = {})
      : std::runtime_error(what), status_(status), field_(std::move(field)) {}
  int status() const noexcept { return status_; }
  const std::string& field() const noexcept { return field_; }

 private:
  int status_;
  std::string field_;
};

}  // namespace loopwarden::page::api
