// SPDX-License-Identifier: Apache-2.0
#include "model/diagnosis/group.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

#include "model/diagnosis/limits.hpp"

namespace loopwarden::diagnosis {

std::vector<Group> find_groups(std::span<const Swinging> loops) {
  std::vector<Swinging> sorted(loops.begin(), loops.end());
  std::sort(sorted.begin(), sorted.end(), [](const Swinging& a, const Swinging& b) {
    return std::tie(a.period_s, a.tag) < std::tie(b.period_s, b.tag);
  });
  std::vector<Group> groups;
  for (std::size_t from = 0; from < sorted.size();) {
    std::size_t to = from + 1;
    while (to < sorted.size() &&
           sorted[to].period_s <= Limits::kSameGroupPeriod * sorted[to - 1].period_s)
      ++to;
    if (to - from >= 2) {
      Group group;
      group.period_s = sorted[(from + to) / 2].period_s;
      std::vector<Swinging> members(sorted.begin() + static_cast<std::ptrdiff_t>(from),
                                    sorted.begin() + static_cast<std::ptrdiff_t>(to));
      std::sort(members.begin(), members.end(), [](const Swinging& a, const Swinging& b) {
        if (a.valve_probability != b.valve_probability)
          return a.valve_probability > b.valve_probability;
        if (a.nonlinearity != b.nonlinearity) return a.nonlinearity > b.nonlinearity;
        return a.tag < b.tag;
      });
      for (const Swinging& member : members) group.loops.push_back(member.loop);
      groups.push_back(std::move(group));
    }
    from = to;
  }
  std::stable_sort(groups.begin(), groups.end(),
                   [](const Group& a, const Group& b) { return a.loops.size() > b.loops.size(); });
  return groups;
}

}  // namespace loopwarden::diagnosis
