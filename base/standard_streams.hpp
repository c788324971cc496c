// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace loopwarden::base {

// Standard output and error output of a program whose exit code tells whether its words were taken.
//
// Printing never fails: the first error of standard output is kept for the end, and what can't be said on the
// error output is lost. A reader that leaves early (`| head -1`) is no error. A stream that is closed stays taken, so that
// no file of the program's own is opened in its place. SIGPIPE and SIGXFSZ are ignored from here on.
//
// To be made once, at the beginning of main.
class StandardStreams {
 public:
  StandardStreams();

  // After the last word. `exit_code`, or 74 with the reason where a good one would not be true.
  int finish(int exit_code);
};

}  // namespace loopwarden::base
