// SPDX-License-Identifier: Apache-2.0
#include "services/fleet/host/status.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

namespace loopwarden::fleet {
namespace {

std::string label(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '\\' || c == '"') escaped += '\\';
    escaped += c;
  }
  return fmt::format("group=\"{}\"", escaped.empty() ? "*" : escaped);
}

class Page {
 public:
  explicit Page(const std::vector<GroupStatus>& groups) : groups_(groups) {}

  template <class Of>
  void family(const char* name, const char* type, const char* help, Of of) {
    head(name, type, help);
    for (const GroupStatus& group : groups_) {
      fmt::format_to(out(), "loopwarden_fleet_{}{{{}}} {}\n", name, label(group.group),
                     static_cast<double>(of(group)));
    }
  }
  template <class Of>
  void counter(const char* name, const char* help, Of of) {
    family(name, "counter", help, of);
  }
  template <class Of>
  void gauge(const char* name, const char* help, Of of) {
    family(name, "gauge", help, of);
  }
  void delays(const char* name, const char* help) {
    head(name, "histogram", help);
    for (const GroupStatus& group : groups_) delay(name, group);
  }
  std::string text() { return std::move(text_); }

 private:
  std::back_insert_iterator<std::string> out() { return std::back_inserter(text_); }
  void head(const char* name, const char* type, const char* help) {
    fmt::format_to(out(), "# HELP loopwarden_fleet_{0} {2}\n# TYPE loopwarden_fleet_{0} {1}\n",
                   name, type, help);
  }
  void delay(const char* name, const GroupStatus& group) {
    const std::string of = label(group.group);
    std::uint64_t below = 0;
    for (std::size_t bin = 0; bin < DelayHistogram::kEdgesS.size(); ++bin) {
      below += group.delay.in_bin(bin);
      fmt::format_to(out(), "loopwarden_fleet_{}_bucket{{{},le=\"{}\"}} {}\n", name, of,
                     DelayHistogram::kEdgesS[bin], below);
    }
    fmt::format_to(out(),
                   "loopwarden_fleet_{0}_bucket{{{1},le=\"+Inf\"}} {2}\n"
                   "loopwarden_fleet_{0}_sum{{{1}}} {3}\nloopwarden_fleet_{0}_count{{{1}}} {2}\n",
                   name, of, group.delay.count(), group.delay.sum_s());
  }

  const std::vector<GroupStatus>& groups_;
  std::string text_;
};

void connections(Page& page) {
  using G = const GroupStatus&;
  page.gauge("owner", "1: this process serves the group", [](G g) { return g.owned; });
  page.gauge("broker_connected", "1: there is a connection to the broker",
             [](G g) { return g.broker_connected; });
  page.counter("broker_connections_total", "connections made to the broker",
               [](G g) { return g.broker_connections; });
  page.gauge("database_connected", "1: there is a connection to the database",
             [](G g) { return g.database_connected; });
  page.gauge("accepting", "0: the edges must store their values, because the spool is full",
             [](G g) { return g.accepting; });
  page.gauge("edges", "known edge nodes", [](G g) { return g.edges; });
  page.gauge("edges_online", "edge nodes with a birth and no death since",
             [](G g) { return g.edges_online; });
}

void flow(Page& page) {
  using G = const GroupStatus&;
  page.counter("messages_total", "messages taken from the spool",
               [](G g) { return g.counts.messages; });
  page.counter("values_written_total", "rows of values", [](G g) { return g.values_written; });
  page.counter("values_duplicate_total", "values that the database had already",
               [](G g) { return g.values_duplicate; });
  page.counter("commits_total", "transactions", [](G g) { return g.commits; });
  page.counter("commit_seconds_total", "time in them", [](G g) { return g.commit_s; });
  page.gauge("spool_messages", "messages that wait for the database",
             [](G g) { return g.spool_messages; });
  page.gauge("spool_bytes", "bytes of waiting messages on the disk",
             [](G g) { return g.spool_bytes; });
  page.counter("spool_dropped_total", "messages dropped because the spool was full",
               [](G g) { return g.spool_dropped; });
  page.delays("delay_seconds", "from the time in a message to its committed row");
}

void faults(Page& page) {
  using G = const GroupStatus&;
  page.counter("garbage_total", "messages that are not Sparkplug B",
               [](G g) { return g.counts.garbage; });
  page.counter("rejected_total", "messages that the database refuses",
               [](G g) { return g.rejected; });
  page.counter("duplicates_total", "duplicate messages", [](G g) { return g.counts.duplicates; });
  page.counter("old_deaths_total", "deaths of connections that newer ones had replaced",
               [](G g) { return g.counts.old_deaths; });
  page.counter("unborn_total", "messages dropped because no birth was received",
               [](G g) { return g.counts.unborn; });
  page.counter("missing_total", "missing sequence numbers", [](G g) { return g.counts.missing; });
  page.counter("conflicts_total", "signs of two edge nodes with one name",
               [](G g) { return g.counts.conflicts; });
  page.counter("unknown_metrics_total", "metrics that are in no birth",
               [](G g) { return g.counts.unknown_metrics; });
  page.counter("bad_times_total", "invalid times, replaced by the time of receipt",
               [](G g) { return g.counts.bad_times; });
  page.counter("births_total", "births of edge nodes", [](G g) { return g.counts.births; });
  page.counter("rebirths_asked_total", "requested rebirths",
               [](G g) { return g.counts.rebirths_asked; });
}

}  // namespace

void DelayHistogram::add(double delay_s) noexcept {
  const auto* const bin = std::lower_bound(kEdgesS.begin(), kEdgesS.end(), delay_s);
  ++bins_[static_cast<std::size_t>(bin - kEdgesS.begin())];
  ++count_;
  // Negative delays count as 0. The clock of an edge may be ahead, but a counter must not decrease.
  sum_s_ += std::max(0.0, delay_s);
}

std::string metrics_text(const std::vector<GroupStatus>& groups) {
  Page page(groups);
  connections(page);
  flow(page);
  faults(page);
  return page.text();
}

}  // namespace loopwarden::fleet
