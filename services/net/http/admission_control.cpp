// SPDX-License-Identifier: Apache-2.0
#include "services/net/http/admission_control.hpp"

#include <algorithm>
#include <cmath>

namespace loopwarden::http {
namespace {

// A view of the page has some 50 files: a browser may open twenty tabs at once.
constexpr double kBurst_s = 20.0;
constexpr std::size_t kMostBuckets = 4096;

// Returns how many of `places` streams may take.
std::size_t most_streams(std::size_t places) { return std::max<std::size_t>(1, places * 3 / 4); }

double seconds(Moment from, Moment to) { return std::chrono::duration<double>(to - from).count(); }

}  // namespace

std::optional<std::uint64_t> AdmissionControl::displaceable(const std::string* address) const {
  std::optional<std::uint64_t> goes;
  for (const auto& [id, client] : clients_) {
    if (client.busy || (address != nullptr && client.address != *address)) continue;
    if (!client.served) return id;  // clients_ is sorted by age: the oldest one
    if (!goes || client.silent_since < clients_.at(*goes).silent_since) goes = id;
  }
  return goes;
}

AdmissionControl::Admission AdmissionControl::admit(const std::string& address, bool loopback,
                                                    Moment now) {
  const auto same = by_address_.find(address);
  const bool crowd = same != by_address_.end() && same->second >= most_of(loopback);
  const bool full = clients_.size() >= limits_.clients;
  Admission admission;
  if (crowd || full) {
    admission.displaced = displaceable(crowd ? &address : nullptr);
    if (!admission.displaced) {
      ++turned_away_;
      return admission;
    }
    ++displaced_;
  }
  // Statements that may throw are first. If one throws, no client is added or removed.
  std::size_t& count = by_address_[address];
  clients_[next_] = {.address = address, .silent_since = now, .loopback = loopback};
  ++count;
  admission.id = next_++;
  if (admission.displaced) left(*admission.displaced);
  return admission;
}

void AdmissionControl::left(std::uint64_t id) {
  const auto client = clients_.find(id);
  if (client == clients_.end()) return;
  const auto count = by_address_.find(client->second.address);
  if (count != by_address_.end() && --count->second == 0) by_address_.erase(count);
  clients_.erase(client);
}

void AdmissionControl::busy(std::uint64_t id) {
  const auto client = clients_.find(id);
  if (client == clients_.end()) return;
  client->second.busy = true;
  client->second.served = true;
}

void AdmissionControl::idle(std::uint64_t id, Moment now) {
  const auto client = clients_.find(id);
  if (client == clients_.end()) return;
  client->second.busy = false;
  client->second.silent_since = now;
}

unsigned AdmissionControl::retry_after_s(const std::string& address, Moment now) {
  if (buckets_.size() >= kMostBuckets) forget_full_buckets(now);
  const double full = limits_.requests_per_s * kBurst_s;
  const auto [it, is_new] = buckets_.try_emplace(address, Bucket{full, now});
  Bucket& bucket = it->second;
  bucket.tokens = std::min(full, bucket.tokens + seconds(bucket.at, now) * limits_.requests_per_s);
  bucket.at = now;
  if (bucket.tokens < 1.0) {
    return std::max(
        1U, static_cast<unsigned>(std::ceil((1.0 - bucket.tokens) / limits_.requests_per_s)));
  }
  bucket.tokens -= 1.0;
  return 0;
}

bool AdmissionControl::stream(std::uint64_t id) {
  const auto client = clients_.find(id);
  if (client == clients_.end()) return false;
  std::size_t all = 0;
  std::size_t same = 0;
  for (const auto& [other, one] : clients_) {
    if (!one.stream) continue;
    ++all;
    if (one.address == client->second.address) ++same;
  }
  client->second.stream =
      all < most_streams(limits_.clients) && same < most_streams(most_of(client->second.loopback));
  return client->second.stream;
}

// A bucket that is full by now is equal to a new one and can be dropped.
void AdmissionControl::forget_full_buckets(Moment now) {
  std::erase_if(buckets_,
                [&](const auto& bucket) { return seconds(bucket.second.at, now) > kBurst_s; });
  if (buckets_.size() >= kMostBuckets) buckets_.clear();
}

}  // namespace loopwarden::http
