// SPDX-License-Identifier: Apache-2.0
// From the daemon's answers to metrics: the box's registers become those of the edge node, each loop a device. Pure.
//
// Metrics have the names of the register map; a field that stands in two tables, to be read and to be written, is one
// metric. Beside them, for each loop: tag, area, description, alarm/NAME/state|severity|since, condition/NAME, explanation/*, incident/*,
// detectable/NAME, order/result, request/evidence and file/NAME. A loop that another controller has lacks what is there
// for orders to its controller alone.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/protocol/answers.hpp"
#include "services/edge/device.hpp"
#include "services/edge/edge_config.hpp"

namespace loopwarden::edge {

// What a loop's registers don't hold: values by the metric's name, null if not known.
using Extras = std::map<std::string, sparkplug::Value>;

struct LoopModel {
  std::string tag;
  std::string device;             // the tag as a topic may hold it, unique
  std::vector<MetricSpec> specs;  // those that all such loops have, then detectable/NAME
  Extras fixed;                   // tag, area, description, detectable/NAME
  bool watched = false;           // another controller has it
  friend bool operator==(const LoopModel&, const LoopModel&) = default;
};

class BoxModel {
 public:
  // Of a daemon that was never seen: the edge node's own metrics, no loop.
  BoxModel();
  // From `registers` with its names and from `describe`. `detectable`: of each tag, percent of the CO span by name.
  // Throws std::out_of_range where an answer is too short.
  using Detectable = std::map<std::string, std::map<std::string, double>>;
  BoxModel(const protocol::Registers& registers, const protocol::Description& describe,
           const DeadBands& dead_bands, const Detectable& detectable);

  const std::vector<MetricSpec>& node_specs() const noexcept { return node_specs_; }
  const std::vector<LoopModel>& loops() const noexcept { return loops_; }
  // The loop of a device; null: none.
  const LoopModel* find(const std::string& device) const noexcept;

  // `registers`: null where the daemon is not there.
  Reading node_reading(const protocol::Registers* registers, const Extras& extras) const;
  Reading loop_reading(std::size_t loop, const protocol::Registers& registers,
                       const Extras& extras) const;
  // A field's place among the values of each loop; nullopt if the map has no such field.
  std::optional<std::size_t> column(const std::string& field) const noexcept;
  // CRC of the configuration in force, of the box's registers.
  std::optional<double> config_hash(const protocol::Registers& registers) const;

  // Whether births of the other would say something else.
  friend bool operator==(const BoxModel& a, const BoxModel& b) {
    return a.node_specs_ == b.node_specs_ && a.loops_ == b.loops_;
  }

 private:
  // One column of the answer becomes metric `metric`, or is a second name for one and is left out.
  struct Column {
    std::size_t column;
    std::size_t metric;
    bool scaled;  // an i16 that has the lowest number where nothing is there
  };
  struct Area {
    std::vector<MetricSpec> specs;  // units still PV and CO
    std::vector<Column> columns;
  };
  Area take_names(const std::vector<protocol::Field>& names, const char* area,
                  const DeadBands& dead_bands) const;
  static void take_values(const Area& area, const std::vector<double>& values,
                          Reading::Item* first);

  Area box_;
  Area loop_;
  std::vector<MetricSpec> node_specs_;  // the node's own, then those of box_
  std::vector<std::pair<std::size_t, std::size_t>> conditions_;  // condition_NAME, condition/NAME
  std::vector<std::size_t> orders_;  // of loop_, ascending: metrics that a watched loop lacks
  std::vector<LoopModel> loops_;
};

// Names of the metrics that name an evidence folder's files, without file/.
const std::vector<std::string>& evidence_files();
// The alarms by which the daemon's answers and the metrics are named.
const std::vector<std::string>& alarm_names();

}  // namespace loopwarden::edge
