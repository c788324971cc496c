// SPDX-License-Identifier: Apache-2.0
#include "page/http/doorkeeper.hpp"

#include <algorithm>
#include <cmath>

namespace loopwarden::page::http {
namespace {

constexpr double kBurst_s = 4.0;
constexpr std::size_t kMostBuckets = 4096;

double seconds(Moment from, Moment to) { return std::chrono::duration<double>(to - from).count(); }

}  // namespace

std::optional<std::uint64_t> Doorkeeper::who_goes(const std::string* address) const {
  std::optional<std::uint64_t> goes;
  for (const auto& [id, guest] : guests_) {
    if (guest.busy || (address != nullptr && guest.address != *address)) continue;
    if (!guest.served) return id;  // the oldest of those
    if (!goes || guest.silent_since < guests_.at(*goes).silent_since) goes = id;
  }
  return goes;
}

Doorkeeper::Admission Doorkeeper::admit(const std::string& address, bool loopback, Moment now) {
  const auto same = by_address_.find(address);
  const bool crowd = !loopback && same != by_address_.end() && same->second >= limits_.per_address;
  const bool full = guests_.size() >= limits_.clients;
  Admission admission;
  if (crowd || full) {
    admission.displaced = who_goes(crowd ? &address : nullptr);
    if (!admission.displaced) {
      ++turned_away_;
      return admission;
    }
    ++displaced_;
    left(*admission.displaced);
  }
  admission.id = next_++;
  guests_[admission.id] = {.address = address, .silent_since = now};
  ++by_address_[address];
  return admission;
}

void Doorkeeper::left(std::uint64_t id) {
  const auto guest = guests_.find(id);
  if (guest == guests_.end()) return;
  const auto count = by_address_.find(guest->second.address);
  if (count != by_address_.end() && --count->second == 0) by_address_.erase(count);
  guests_.erase(guest);
}

void Doorkeeper::busy(std::uint64_t id) {
  const auto guest = guests_.find(id);
  if (guest == guests_.end()) return;
  guest->second.busy = true;
  guest->second.served = true;
}

void Doorkeeper::idle(std::uint64_t id, Moment now) {
  const auto guest = guests_.find(id);
  if (guest == guests_.end()) return;
  guest->second.busy = false;
  guest->second.silent_since = now;
}

unsigned Doorkeeper::wait_s(const std::string& address, Moment now) {
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

// Those that would be full by now say nothing that a new one would not.
void Doorkeeper::forget_full_buckets(Moment now) {
  std::erase_if(buckets_,
                [&](const auto& bucket) { return seconds(bucket.second.at, now) > kBurst_s; });
  if (buckets_.size() >= kMostBuckets) buckets_.clear();
}

}  // namespace loopwarden::page::http
