// SPDX-License-Identifier: Apache-2.0
#include "workbench/files/output_files.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <memory>
#include <system_error>
#include <utility>

#include "base/file.hpp"

namespace loopwarden::workbench {
namespace {

namespace fs = std::filesystem;

// Files and folders to delete if a signal ends the program. Entries are only added, at the front,
// so the handler can walk the list at any time. So files are deleted before the folders that were
// made for them.
struct Passing {
  std::string path;
  bool folder = false;
  std::atomic<bool> present{true};
  Passing* next = nullptr;
};
std::atomic<Passing*> passing{nullptr};

void remove_passing() noexcept {
  for (Passing* entry = passing.load(); entry != nullptr; entry = entry->next) {
    if (!entry->present.exchange(false)) continue;
    if (entry->folder) {
      ::rmdir(entry->path.c_str());
    } else {
      ::unlink(entry->path.c_str());
    }
  }
}

void on_end(int signal) {
  remove_passing();
  // The default action is restored, so this ends the program as the signal would have.
  raise(signal);
}

void watch_signals() {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction before {};
    sigaction(signal, nullptr, &before);
    // Keeps the handlers of commands that end cleanly on a signal, and the setting of nohup.
    if (before.sa_handler != SIG_DFL) continue;
    struct sigaction action {};
    action.sa_handler = on_end;
    action.sa_flags = static_cast<int>(SA_RESETHAND);
    sigaction(signal, &action, nullptr);
  }
}

void remember(const fs::path& path, bool folder) {
  auto entry = std::make_unique<Passing>();
  entry->path = path.string();
  entry->folder = folder;
  entry->next = passing.load();
  passing.store(entry.release());  // never freed: the handler may be reading it
}

void forget(const fs::path& path) {
  for (Passing* entry = passing.load(); entry != nullptr; entry = entry->next) {
    if (entry->path == path.native()) entry->present = false;
  }
}

[[noreturn]] void fail_at(const fs::path& path, std::string_view what, int error) {
  throw OutputError(kExitIo, path.string() + ": " + std::string(what) + ": " +
                                 std::generic_category().message(error));
}

// Returns whether a path is a stream. A file whose links never end (in /proc, standard output)
// can't be replaced.
bool is_stream(const fs::path& path) {
  struct stat of {};
  if (::stat(path.c_str(), &of) != 0 || S_ISDIR(of.st_mode)) return false;
  struct stat output {};
  const bool own = ::fstat(STDOUT_FILENO, &output) == 0 && output.st_dev == of.st_dev &&
                   output.st_ino == of.st_ino;
  return !S_ISREG(of.st_mode) || own;
}

// Returns errno, or 0 if all was written.
int write_to(int fd, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(fd, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return 0;
}

int write_file(const fs::path& path, int flags, std::string_view text) {
  const int fd = ::open(path.c_str(), flags | O_WRONLY | O_CLOEXEC, 0666);
  if (fd < 0) return errno;
  const int error = write_to(fd, text);
  return ::close(fd) != 0 && error == 0 ? errno : error;
}

int copy_to_stream(const fs::path& from, const fs::path& stream) {
  const int in = ::open(from.c_str(), O_RDONLY | O_CLOEXEC);
  if (in < 0) return errno;
  std::fflush(stdout);
  const int out = ::open(stream.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  int error = out < 0 ? errno : 0;
  std::string block(1UL << 16U, '\0');
  while (error == 0) {
    const ssize_t got = ::read(in, block.data(), block.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) error = errno;
    if (got <= 0) break;
    error = write_to(out, std::string_view(block).substr(0, static_cast<std::size_t>(got)));
  }
  ::close(in);
  if (out >= 0 && ::close(out) != 0 && error == 0) error = errno;
  return error;
}

// Blocks signals from the first rename to the last.
class SignalsHeld {
 public:
  SignalsHeld() {
    sigset_t held;
    sigemptyset(&held);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&held, signal);
    pthread_sigmask(SIG_BLOCK, &held, &before_);
  }
  SignalsHeld(const SignalsHeld&) = delete;
  SignalsHeld& operator=(const SignalsHeld&) = delete;
  ~SignalsHeld() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

 private:
  sigset_t before_{};
};

fs::path beside(const fs::path& path, const char* what) {
  return path.parent_path() /
         ("." + path.filename().string() + "." + std::to_string(::getpid()) + what);
}

void remove_file(const fs::path& path) {
  ::unlink(path.c_str());
  forget(path);
}

}  // namespace

OutputFiles::OutputFiles(std::vector<std::string> inputs) {
  for (std::string& input : inputs) {
    if (!input.empty()) inputs_.emplace_back(std::move(input));
  }
  watch_signals();
}

OutputFiles::~OutputFiles() {
  for (const Staged& staged : staged_) {
    remove_file(staged.temporary);
    remove_file(staged.temporary.string() + ".tmp");
  }
  for (auto folder = folders_.rbegin(); folder != folders_.rend(); ++folder) {
    ::rmdir(folder->c_str());  // fails if it contains other files by now
    forget(*folder);
  }
}

void OutputFiles::refuse_input(const fs::path& path) const {
  for (const fs::path& input : inputs_) {
    std::error_code ignored;
    if (fs::is_regular_file(path, ignored) && fs::equivalent(path, input, ignored)) {
      throw OutputError(kExitUsage, path.string() + ": is the input " + input.string() +
                                        "; give the output another name");
    }
  }
}

void OutputFiles::make_folder(const fs::path& folder) {
  std::error_code error;
  if (folder.empty() || fs::is_directory(folder, error)) return;
  make_folder(folder.parent_path());
  if (::mkdir(folder.c_str(), 0777) == 0) {
    folders_.push_back(folder);
    remember(folder, true);
  } else if (errno != EEXIST || !fs::is_directory(folder, error)) {
    fail_at(folder, "can't be made", errno);
  }
}

fs::path OutputFiles::make_scratch_folder() {
  std::string folder = (fs::temp_directory_path() / "loopwarden-XXXXXX").string();
  if (::mkdtemp(folder.data()) == nullptr) fail_at(folder, "can't be made", errno);
  folders_.emplace_back(folder);
  remember(folder, true);
  return folder;
}

fs::path OutputFiles::stage(const fs::path& path) {
  for (const Staged& staged : staged_) {
    if (staged.asked == path) return staged.temporary;
  }
  refuse_input(path);
  Staged staged{.asked = path, .target = path, .temporary = {}, .stream = is_stream(path)};
  if (staged.stream) {
    staged.temporary = beside(fs::temp_directory_path() / "loopwarden", ".tmp");
    staged.temporary += std::to_string(staged_.size());
  } else {
    // Follows links, including dangling ones, so that the link is kept.
    std::error_code error;
    if (fs::is_symlink(path)) staged.target = fs::weakly_canonical(path, error);
    if (error) fail_at(path, "can't be written", error.value());
    if (fs::is_directory(staged.target, error)) fail_at(path, "can't be written", EISDIR);
    if (staged.target.filename().empty()) fail_at(path, "can't be written", EISDIR);
    if (::access(staged.target.c_str(), W_OK) != 0 && errno != ENOENT) {
      fail_at(path, "can't be written", errno);
    }
    const fs::path folder = staged.target.has_parent_path() ? staged.target.parent_path() : ".";
    if (::access(folder.c_str(), W_OK) != 0) fail_at(path, "can't be written", errno);
    staged.temporary = beside(staged.target, ".tmp");
  }
  remember(staged.temporary, false);
  remember(staged.temporary.string() + ".tmp", false);
  staged_.push_back(std::move(staged));
  return staged_.back().temporary;
}

void OutputFiles::add(const fs::path& path, std::string_view text) {
  const int error = write_file(stage(path), O_CREAT | O_TRUNC, text);
  if (error != 0) fail_at(path, "can't be written", error);
  const auto staged = std::find_if(staged_.begin(), staged_.end(),
                                   [&](const Staged& one) { return one.asked == path; });
  std::rotate(staged, staged + 1, staged_.end());
}

int OutputFiles::sync_data(fs::path& failed) const {
  for (const Staged& staged : staged_) {
    failed = staged.asked;
    if (staged.stream) continue;
    base::File file(staged.temporary, O_RDONLY);
    if (!file.is_open() && errno == ENOENT) continue;
    if (!file.is_open() || !file.sync()) return errno;
  }
  return 0;
}

int OutputFiles::give_names(std::vector<Named>& done, fs::path& failed) const {
  fs::path last_folder;
  const auto sync = [&] { return last_folder.empty() || base::sync_folder(last_folder); };
  for (const Staged& staged : staged_) {
    // The file was staged, but the command did not write it.
    if (::access(staged.temporary.c_str(), F_OK) != 0) continue;
    failed = staged.asked;
    if (staged.stream) {
      const int error = copy_to_stream(staged.temporary, staged.target);
      if (error != 0) return error;
      done.push_back({.staged = &staged, .replaced = false, .earlier = {}});
      continue;
    }
    // Renames in one folder reach the disk in their order. The last rename waits for all others.
    const fs::path folder = staged.target.has_parent_path() ? staged.target.parent_path() : ".";
    if ((folder != last_folder || &staged == &staged_.back()) && !sync()) return errno;
    last_folder = folder;
    Named now{.staged = &staged, .replaced = false, .earlier = {}};
    struct stat target {};
    if (::stat(staged.target.c_str(), &target) == 0) {
      ::chmod(staged.temporary.c_str(), target.st_mode & 07777U);
      now.replaced = true;
      now.earlier = beside(staged.target, ".earlier");
      if (::link(staged.target.c_str(), now.earlier.c_str()) != 0) now.earlier.clear();
    }
    if (::rename(staged.temporary.c_str(), staged.target.c_str()) != 0) {
      const int error = errno;
      if (!now.earlier.empty()) ::unlink(now.earlier.c_str());
      return error;
    }
    done.push_back(std::move(now));
  }
  return sync() ? 0 : errno;
}

void OutputFiles::commit() {
  const SignalsHeld held;
  std::vector<Named> done;
  fs::path failed;
  int error = sync_data(failed);
  if (error == 0) error = give_names(done, failed);
  if (error != 0) {
    // Restores the last file first, so that the set stays consistent.
    for (auto one = done.rbegin(); one != done.rend(); ++one) {
      if (!one->earlier.empty()) {
        ::rename(one->earlier.c_str(), one->staged->target.c_str());
      } else if (!one->replaced && !one->staged->stream) {
        ::unlink(one->staged->target.c_str());
      }
    }
    fail_at(failed, "can't be written", error);
  }
  for (const Named& one : done) {
    if (!one.earlier.empty()) ::unlink(one.earlier.c_str());
  }
  for (const Staged& staged : staged_) {
    remove_file(staged.temporary);  // of a stream
    forget(staged.temporary.string() + ".tmp");
  }
  for (const fs::path& folder : folders_) forget(folder);
  staged_.clear();
  folders_.clear();
}

std::string OutputFiles::in_users_words(std::string message) const {
  for (const Staged& staged : staged_) {
    for (const std::string& name :
         {staged.temporary.string() + ".tmp", staged.temporary.string()}) {
      const std::size_t at = message.find(name);
      if (at != std::string::npos) message.replace(at, name.size(), staged.asked.string());
    }
  }
  return message;
}

void write_output(const fs::path& path, std::string_view text, std::vector<std::string> inputs) {
  OutputFiles files(std::move(inputs));
  files.add(path, text);
  files.commit();
}

}  // namespace loopwarden::workbench
