// SPDX-License-Identifier: Apache-2.0
// Runs the benchmarks and prints the median of repetitions next to the budgets. Accepts Google
// Benchmark's own options too, e.g. --benchmark_filter=simulate.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <map>
#include <string>
#include <vector>

#include "lab/bench/budgets.hpp"

namespace {

class Collector final : public benchmark::BenchmarkReporter {
 public:
  bool ReportContext(const Context&) override { return true; }
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      // A benchmark that runs once has no median.
      const bool median = run.run_type == Run::RT_Aggregate && run.aggregate_name == "median";
      const bool once = run.run_type == Run::RT_Iteration && run.repetitions == 1;
      if (!median && !once) continue;
      if (run.error_occurred) {
        fmt::print(stderr, "{}: {}\n", run.run_name.function_name, run.error_message);
        failed = true;
        continue;
      }
      const auto items = run.counters.find("items_per_second");
      // In the benchmark's time unit, which is nanoseconds by default.
      seconds[run.run_name.function_name] = run.GetAdjustedRealTime() * 1e-9;
      if (items != run.counters.end()) per_second[run.run_name.function_name] = items->second;
    }
  }
  bool failed = false;
  std::map<std::string, double> seconds;
  std::map<std::string, double> per_second;
};

}  // namespace

int main(int argc, char** argv) {
  std::vector<char*> arguments(argv, argv + argc);
  std::string repetitions = "--benchmark_repetitions=9";
  std::string aggregates = "--benchmark_report_aggregates_only=true";
  std::string shorter = "--benchmark_min_time=0.1";
  arguments.insert(arguments.begin() + 1, {repetitions.data(), aggregates.data(), shorter.data()});
  int count = static_cast<int>(arguments.size());
  benchmark::Initialize(&count, arguments.data());
  if (benchmark::ReportUnrecognizedArguments(count, arguments.data())) return 64;

  Collector collector;
  benchmark::RunSpecifiedBenchmarks(&collector);
  fmt::print("{:<52} {:>12} {:>12}  {:<18} {}\n", "what", "measured", "budget", "unit", "kept");
  for (const auto& budget : loopwarden::bench::kBudgets) {
    const auto& source = budget.per_second ? collector.per_second : collector.seconds;
    const auto it = source.find(budget.benchmark);
    if (it == source.end()) continue;
    const double figure = it->second * budget.scale;
    const bool kept = budget.at_least ? figure >= budget.limit : figure <= budget.limit;
    fmt::print("{:<52} {:>12.4g} {:>12.4g}  {:<18} {}\n", budget.what, figure, budget.limit,
               budget.unit, kept ? "yes" : "NO");
  }
  return collector.failed ? 1 : 0;
}
