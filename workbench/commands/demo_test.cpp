// SPDX-License-Identifier: Apache-2.0
#include "workbench/commands/demo_test.hpp"

#include <fmt/format.h>

#include <vector>

#include "model/estimator/judge_test.hpp"
#include "model/gap/workflow.hpp"
#include "model/plant/simulated_loop.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/files/model_file.hpp"
#include "daemon/protocol/planned_test/planned_test.hpp"
#include "workbench/text/next_test_text.hpp"
#include "workbench/text/posterior_bars.hpp"

namespace loopwarden::workbench {
namespace {

numeric::LoopRecord recorded(const plant::LoopModel& model) {
  plant::SimulatedLoop loop(model);
  numeric::LoopRecord record;
  record.period_s = model.sample_time_s;
  while (record.seconds_at(record.size()) < model.scenario.duration_s) {
    const plant::LoopSample s = loop.step();
    record.sp.push_back(s.sp);
    record.pv.push_back(s.pv);
    record.co.push_back(s.co);
  }
  return record;
}

estimator::Observed observed(double period_s, const std::vector<double>& co,
                             const std::vector<double>& pv) {
  return {.period_s = period_s, .co = co, .pv = pv, .used = std::vector<bool>(pv.size(), true)};
}

std::string probabilities(const std::vector<gap::Probability>& explanations,
                          const std::vector<double>& values) {
  std::string text;
  for (std::size_t i = 0; i < explanations.size(); ++i) {
    text += fmt::format("{}{} {:.0f} %", i == 0 ? "" : ", ", title_of(explanations[i].effects),
                        100.0 * values[i]);
  }
  return text;
}

}  // namespace

void show_test_scene(const std::string& model_file,
                     const std::function<void(const std::string&)>& say) {
  const plant::LoopModel truth = load_model(model_file);
  plant::LoopModel believed = truth;
  believed.valve_effects.clear();
  const numeric::LoopRecord record = recorded(truth);
  const numeric::ParallelFor parallel = on_threads(threads(0));
  say(fmt::format("A second valve is worn. Its record of {:.0f} s has more than one explanation:",
                  truth.scenario.duration_s));
  const gap::Result found = gap::find_gap(record, believed, {}, parallel, [](double) {});
  if (!found.next_test) {
    say(found.why_no_test.empty() ? found.sentence : found.why_no_test);
    return;
  }
  const std::vector<gap::Probability>& explanations = found.next_test->explanations;
  std::vector<double> before;
  std::vector<std::vector<std::string>> names;
  for (const gap::Probability& one : explanations) {
    before.push_back(one.probability);
    names.push_back(one.effects);
  }
  say("  " + probabilities(explanations, before));
  say(proposed_test_text(found.next_test->plan, names_of(*found.next_test)));
  say("The move is made on the simulated plant, and both records are explained together:");
  const protocol::TestRecord test = protocol::simulate_test(truth, plan_file(found));
  const estimator::Judged judged =
      estimator::judge_test(names, observed(record.period_s, record.co, record.pv),
                            observed(test.period_s, test.co, test.pv), believed, {}, parallel);
  say("  " + probabilities(explanations, judged.probability));
  say(judged.decided < 0 ? "The test has not decided."
                         : fmt::format("Decided: {}. The valve was simulated with {}.",
                                       title_of(names[static_cast<std::size_t>(judged.decided)]),
                                       truth.valve_effects.front().name));
}

}  // namespace loopwarden::workbench
