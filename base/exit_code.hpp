// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sysexits.h>

namespace loopwarden {

// Exit codes of every program, as documented in --help.
enum ExitCode : int {
  kExitOk = EX_OK,
  kExitUsage = EX_USAGE,
  kExitData = EX_DATAERR,
  kExitIo = EX_IOERR,
  kExitTryAgain = EX_TEMPFAIL,
  kExitConfiguration = EX_CONFIG
};

}  // namespace loopwarden
