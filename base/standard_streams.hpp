// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace loopwarden::base {

// Standard output and error output of a program whose exit code shows whether its output was
// written.
//
// Printing never fails. The first error of standard output is reported at the end. Text that can't
// be written to the error output is lost. A reader that leaves early (`| head -1`) is no error. A
// closed stream stays reserved, so that a file opened later does not take its place. SIGPIPE and
// SIGXFSZ are ignored from here on.
//
// Create one object at the beginning of main.
class StandardStreams {
 public:
  StandardStreams();

  // Flushes the output at the end of the program. Returns `exit_code`, or 74 with a message if that
  // was success but output was lost.
  int finish(int exit_code);
};

}  // namespace loopwarden::base
