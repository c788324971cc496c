// SPDX-License-Identifier: Apache-2.0
// Maps the daemon's answers to metrics: the box's registers become metrics of the edge node, and
// each loop becomes a device. Pure.
//
// Metrics have the names of the register map. A field that occurs in a table for reading and in one
// for writing is one metric. Each loop also has the metrics tag, area, description,
// alarm/NAME/state|severity|since, condition/NAME, explanation/*, incident/*, detectable/NAME,
// order/result, request/evidence and file/NAME. A loop of another controller lacks the metrics that
// only serve commands to its controller.
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

// Values of a loop that its registers don't hold, by the metric's name; null if not known.
using Extras = std::map<std::string, sparkplug::Value>;

struct LoopModel {
  std::string tag;
  std::string device;             // the tag as a topic may hold it, unique
  std::vector<MetricSpec> specs;  // those of all such loops, then detectable/NAME
  Extras fixed;                   // tag, area, description, detectable/NAME
  bool watched = false;           // another controller runs it
  friend bool operator==(const LoopModel&, const LoopModel&) = default;
};

class BoxModel {
 public:
  // The model of a daemon that was never reached: the edge node's own metrics, no loops.
  BoxModel();
  // `registers`: with its names. `detectable`: for each tag, percent of the CO span by name. Throws
  // std::out_of_range if an answer is too short.
  using Detectable = std::map<std::string, std::map<std::string, double>>;
  BoxModel(const protocol::Registers& registers, const protocol::Description& describe,
           const DeadBands& dead_bands, const Detectable& detectable);

  const std::vector<MetricSpec>& node_specs() const noexcept { return node_specs_; }
  const std::vector<LoopModel>& loops() const noexcept { return loops_; }
  // Returns the loop of a device; null if the device is unknown.
  const LoopModel* find(const std::string& device) const noexcept;

  // `registers`: null if the daemon does not answer.
  Reading node_reading(const protocol::Registers* registers, const Extras& extras) const;
  Reading loop_reading(std::size_t loop, const protocol::Registers& registers,
                       const Extras& extras) const;
  // Returns the index of a field in the values of each loop; nullopt if the map lacks the field.
  std::optional<std::size_t> column(const std::string& field) const noexcept;
  // Returns the CRC of the configuration in force, as in the box's registers.
  std::optional<double> config_hash(const protocol::Registers& registers) const;

  // Returns whether both models lead to the same births.
  friend bool operator==(const BoxModel& a, const BoxModel& b) {
    return a.node_specs_ == b.node_specs_ && a.loops_ == b.loops_;
  }

 private:
  // One column of the answer. It becomes metric `metric`, or is left out as its second name.
  struct Column {
    std::size_t column;
    std::size_t metric;
    bool scaled;  // an i16 whose lowest number means "no value"
  };
  struct Area {
    std::vector<MetricSpec> specs;  // units are still PV and CO
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

// Returns the names of the metrics for an evidence folder's files, without file/.
const std::vector<std::string>& evidence_files();
// Returns the names of alarms in the daemon's answers and in metrics.
const std::vector<std::string>& alarm_names();

}  // namespace loopwarden::edge
