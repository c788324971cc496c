// SPDX-License-Identifier: Apache-2.0
// One function per path; router.cpp has the table. They throw ApiError, DaemonError or FleetDown.
#pragma once

#include "services/page/api/context.hpp"

namespace loopwarden::page::api {

// session.cpp
http::Response session(Context& context, const Call& call);
http::Response log_in(Context& context, const Call& call);
http::Response log_out(Context& context, const Call& call);

// live.cpp
http::Response describe(Context& context, const Call& call);
http::Response events(Context& context, const Call& call);
http::Response sparklines(Context& context, const Call& call);
http::Response alarms(Context& context, const Call& call);
http::Response alarm_figures(Context& context, const Call& call);
http::Response system(Context& context, const Call& call);

// loop.cpp
http::Response loop(Context& context, const Call& call);
http::Response windows(Context& context, const Call& call);
http::Response loop_alarms(Context& context, const Call& call);
http::Response loop_alarm(Context& context, const Call& call);
http::Response act_on_alarm(Context& context, const Call& call);
http::Response note(Context& context, const Call& call);
http::Response acknowledge_incident(Context& context, const Call& call);

// loop_reports.cpp
http::Response loop_reports(Context& context, const Call& call);
http::Response ask_for_report(Context& context, const Call& call);

// order.cpp
http::Response order(Context& context, const Call& call);
http::Response tune(Context& context, const Call& call);

// tuning.cpp
http::Response proposed_gains(Context& context, const Call& call);

// planned_test.cpp
http::Response planned_test(Context& context, const Call& call);
http::Response act_on_test(Context& context, const Call& call);

// past.cpp
http::Response past(Context& context, const Call& call);
http::Response past_csv(Context& context, const Call& call);

// journal.cpp
http::Response journal(Context& context, const Call& call);
http::Response journal_csv(Context& context, const Call& call);

// reports.cpp
http::Response reports(Context& context, const Call& call);
http::Response report(Context& context, const Call& call);
http::Response evidence(Context& context, const Call& call);

// fleet.cpp
http::Response fleet_overview(Context& context, const Call& call);
http::Response fleet_valve(Context& context, const Call& call);

}  // namespace loopwarden::page::api
