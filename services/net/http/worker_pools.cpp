// SPDX-License-Identifier: Apache-2.0
#include "services/net/http/worker_pools.hpp"

#include <algorithm>
#include <utility>

namespace loopwarden::http {
namespace {

// Enough for callers of argon2, JSON and file readers. None of them recurses deeply.
constexpr std::size_t kStackBytes = 1024UL * 1024UL;

}  // namespace

WorkerPools::WorkerPools(const std::array<PoolSize, kPools>& sizes) {
  for (std::size_t i = 0; i < kPools; ++i) {
    Queue& queue = queues_[i];
    queue.most = sizes[i].queue;
    for (std::size_t n = 0; n < sizes[i].threads; ++n) {
      queue.threads.push_back(std::make_unique<base::Thread>());
      queue.threads.back()->start({.name = sizes[i].thread_name, .stack_bytes = kStackBytes},
                                  [&queue] { run(queue); });
    }
  }
}

bool WorkerPools::begin(Pool pool, const std::string& whose, Work work) {
  Queue& queue = queues_[static_cast<std::size_t>(pool)];
  {
    const std::lock_guard lock(queue.mutex);
    const auto same = static_cast<std::size_t>(std::count_if(
        queue.items.begin(), queue.items.end(), [&](const Item& i) { return i.whose == whose; }));
    if (queue.quit || queue.items.size() >= queue.most ||
        same >= std::max(queue.most / 2, std::size_t{1})) {
      return false;
    }
    queue.items.push_back({whose, std::move(work)});
  }
  queue.filled.notify_one();
  return true;
}

void WorkerPools::run(Queue& queue) {
  for (;;) {
    Item item;
    {
      std::unique_lock lock(queue.mutex);
      queue.filled.wait(lock, [&] { return queue.quit || !queue.items.empty(); });
      if (queue.quit) return;
      item = std::move(queue.items.front());
      queue.items.pop_front();
    }
    item.work();
  }
}

void WorkerPools::stop() {
  for (Queue& queue : queues_) {
    {
      const std::lock_guard lock(queue.mutex);
      queue.quit = true;
      queue.items.clear();
    }
    queue.filled.notify_all();
  }
  for (Queue& queue : queues_) queue.threads.clear();
}

}  // namespace loopwarden::http
