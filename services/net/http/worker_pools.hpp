// SPDX-License-Identifier: Apache-2.0
// Thread pools that make answers. Each pool has a few threads and a bounded queue.
#pragma once

#include <array>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "base/thread.hpp"
#include "services/net/http/message.hpp"

namespace loopwarden::http {

struct PoolSize {
  const char* thread_name = "";  // at most 15 characters
  std::size_t threads = 0;
  std::size_t queue = 0;
};

class WorkerPools {
 public:
  using Work = std::function<void()>;

  explicit WorkerPools(const std::array<PoolSize, kPools>& sizes);
  WorkerPools(const WorkerPools&) = delete;
  WorkerPools& operator=(const WorkerPools&) = delete;
  ~WorkerPools() { stop(); }

  // Queues `work`, which must not throw. Returns false if the pool's queue is full, or if one
  // client (`whose`) has half of it already.
  bool begin(Pool pool, const std::string& whose, Work work);
  // Ends the threads. Queued work is dropped.
  void stop();

 private:
  struct Item {
    std::string whose;
    Work work;
  };
  struct Queue {
    std::mutex mutex;
    std::condition_variable filled;
    std::deque<Item> items;
    std::size_t most = 0;
    bool quit = false;
    std::vector<std::unique_ptr<base::Thread>> threads;
  };
  static void run(Queue& queue);

  std::array<Queue, kPools> queues_;
};

}  // namespace loopwarden::http
