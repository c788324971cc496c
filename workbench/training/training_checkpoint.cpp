// SPDX-License-Identifier: Apache-2.0
#include "workbench/training/training_checkpoint.hpp"

#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>
#include <vector>

#include "base/file.hpp"

namespace loopwarden::workbench {
namespace {

using nlohmann::json;
using specialist::Learned;
using specialist::Network;
using specialist::TeamRestart;

json as_json(const Network& network) {
  const specialist::NetworkShape s = network.shape();
  json weights = json::array();
  for (const specialist::Layer& layer : network.layers) {
    for (const double w : layer.weights.reshaped()) weights.push_back(w);
    for (const double b : layer.bias) weights.push_back(b);
  }
  return {{"layers", {s.inputs, s.first_hidden, s.second_hidden, s.outputs}},
          {"weights", std::move(weights)}};
}

// Throws json::exception or std::out_of_range if the text is not a network.
Network network_of(const json& from) {
  const auto layers = from.at("layers").get<std::vector<std::size_t>>();
  const auto weights = from.at("weights").get<std::vector<double>>();
  const specialist::NetworkShape shape{layers.at(0), layers.at(1), layers.at(2), layers.at(3)};
  if (weights.size() != shape.weights()) throw std::out_of_range("weights");
  Network network(shape);
  std::size_t next = 0;
  for (specialist::Layer& layer : network.layers) {
    for (double& w : layer.weights.reshaped()) w = weights.at(next++);
    for (double& b : layer.bias) b = weights.at(next++);
  }
  return network;
}

void write(const std::filesystem::path& path, const json& content) {
  std::error_code ignored;
  std::filesystem::create_directories(path.parent_path(), ignored);
  (void)base::replace_file(path, content.dump(), {.mode = 0666, .wait_for_disk = false});
}

// Returns the result of `take` for the file's content; nullopt if the file is missing, of another
// run, or unusable.
template <class Take>
auto read(const std::filesystem::path& path, const std::string& key, Take take)
    -> decltype(take(json())) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return std::nullopt;
  const json content = json::parse(in, nullptr, false);
  if (!content.is_object() || content.value("key", std::string()) != key) return std::nullopt;
  try {
    return take(content);
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

}  // namespace

TrainingCheckpoint::TrainingCheckpoint(std::filesystem::path folder, std::string key)
    : folder_(std::move(folder)), key_(std::move(key)) {}

std::optional<Learned> TrainingCheckpoint::find_network(const std::string& name) const {
  return read(folder_ / (name + ".json"), key_, [&](const json& content) -> std::optional<Learned> {
    Learned learned;
    learned.network = network_of(content.at("network"));
    learned.best = content.at("best").get<std::size_t>();
    learned.stop = static_cast<specialist::Stop>(content.at("stop").get<int>());
    for (const json& e : content.at("epochs")) {
      learned.epochs.push_back({e.at(0), e.at(1), e.at(2), e.at(3), e.at(4)});
    }
    if (learned.best >= learned.epochs.size()) return std::nullopt;
    return learned;
  });
}

void TrainingCheckpoint::keep_network(const std::string& name, const Learned& learned) const {
  json epochs = json::array();
  for (const specialist::Epoch& e : learned.epochs) {
    epochs.push_back({e.training, e.validation, e.test, e.gradient, e.mu});
  }
  write(folder_ / (name + ".json"), {{"key", key_},
                                     {"network", as_json(learned.network)},
                                     {"best", learned.best},
                                     {"stop", static_cast<int>(learned.stop)},
                                     {"epochs", std::move(epochs)}});
}

std::optional<std::vector<specialist::Example>> TrainingCheckpoint::find_examples(
    const std::string& name, std::size_t count) const {
  return read(folder_ / (name + ".json"), key_,
              [&](const json& content) -> std::optional<std::vector<specialist::Example>> {
                std::vector<specialist::Example> examples;
                for (const json& kept : content.at("examples")) {
                  specialist::Example& example = examples.emplace_back();
                  example.condition =
                      static_cast<specialist::Condition>(kept.at("condition").get<int>());
                  example.log_misfit = kept.at("log_misfit").get<double>();
                  if (kept.at("evidence").size() != example.inputs.size()) return std::nullopt;
                  for (std::size_t i = 0; i < example.inputs.size(); ++i) {
                    example.inputs[i] = kept["evidence"][i].get<double>();
                  }
                }
                if (examples.size() != count) return std::nullopt;
                return examples;
              });
}

void TrainingCheckpoint::keep_examples(const std::string& name,
                                       const std::vector<specialist::Example>& examples) const {
  json kept = json::array();
  for (const specialist::Example& example : examples) {
    kept.push_back({{"condition", static_cast<int>(example.condition)},
                    {"log_misfit", example.log_misfit},
                    {"evidence", example.inputs}});
  }
  write(folder_ / (name + ".json"), {{"key", key_}, {"examples", std::move(kept)}});
}

std::optional<TeamRestart> TrainingCheckpoint::find_team(const std::string& name) const {
  return read(folder_ / (name + ".json"), key_,
              [&](const json& content) -> std::optional<TeamRestart> {
                TeamRestart restart;
                for (std::size_t c = 0; c < specialist::kConditions; ++c) {
                  restart.networks[c] = network_of(content.at("networks").at(c));
                }
                restart.validation = content.at("validation");
                for (const json& e : content.at("epochs")) {
                  restart.epochs.push_back({e.at(0), e.at(1), e.at(2), e.at(3)});
                }
                return restart;
              });
}

void TrainingCheckpoint::keep_team(const std::string& name, const TeamRestart& restart) const {
  json networks = json::array();
  for (const Network& network : restart.networks) networks.push_back(as_json(network));
  json epochs = json::array();
  for (const specialist::TeamEpoch& e : restart.epochs) {
    epochs.push_back({e.restart, e.epoch, e.training, e.validation});
  }
  write(folder_ / (name + ".json"), {{"key", key_},
                                     {"networks", std::move(networks)},
                                     {"validation", restart.validation},
                                     {"epochs", std::move(epochs)}});
}

void TrainingCheckpoint::remove(const std::filesystem::path& folder) {
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    const std::filesystem::path& path = entry.path();
    if (path.extension() == ".json" || path.extension() == ".tmp") {
      std::filesystem::remove(path, ignored);
    }
  }
  std::filesystem::remove(folder, ignored);  // fails if the folder has other files
}

}  // namespace loopwarden::workbench
