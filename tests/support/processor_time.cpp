// SPDX-License-Identifier: Apache-2.0
// Appends the processor time of every test case, including the programs it waited for, as a line
// "SECONDS TAB TAGS TAB NAME" to the file $LOOPWARDEN_TEST_TIMES.
#define CATCH_CONFIG_EXTERNAL_INTERFACES
#include <sys/resource.h>

#include <catch2/catch.hpp>
#include <cstdio>
#include <cstdlib>

namespace loopwarden::tests {
namespace {

double used_s(int who) {
  rusage used{};
  getrusage(who, &used);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

double processor_s() { return used_s(RUSAGE_SELF) + used_s(RUSAGE_CHILDREN); }

class ProcessorTime : public Catch::TestEventListenerBase {
 public:
  using TestEventListenerBase::TestEventListenerBase;

  void testCaseStarting(const Catch::TestCaseInfo&) override { start_s_ = processor_s(); }

  void testCaseEnded(const Catch::TestCaseStats& test) override {
    const char* path = std::getenv("LOOPWARDEN_TEST_TIMES");
    if (path == nullptr) return;
    std::FILE* file = std::fopen(path, "ae");
    if (file == nullptr) return;
    std::fprintf(file, "%.2f\t%s\t%s\n", processor_s() - start_s_,
                 test.testInfo.tagsAsString().c_str(), test.testInfo.name.c_str());
    std::fclose(file);
  }

 private:
  double start_s_ = 0.0;
};

CATCH_REGISTER_LISTENER(ProcessorTime)

}  // namespace
}  // namespace loopwarden::tests
