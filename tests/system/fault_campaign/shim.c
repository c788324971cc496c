/* SPDX-License-Identifier: Apache-2.0
 * Injects faults into the program under test (LD_PRELOAD): the daemon, the edge or the notifier.
 * A small file that the test maps as well switches them:
 *
 * - a disk that is full or slow, and a wall clock that jumps. Only regular files are affected.
 * - a disk that is slow for some of the daemon's files: each opening, renaming and syncing is
 *   delayed.
 * - a disk that hangs: opening, writing, syncing and renaming of some of the daemon's files wait.
 * - attributes of IIO devices, as plain files with the sticky bit. Without its name (the
 *   device is gone), a file returns ENODEV as sysfs does. Without its owner's right to read or
 *   write, it returns EIO. Without its group's right to write, it discards writes. Without the
 *   others' right to read, a read waits. Written values are recorded.
 * - the lines of a GPIO chip, instead of libgpiod 1. A released line keeps its level.
 */
#define _GNU_SOURCE
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

enum { LINES = 16, DEEDS = 1024 };

struct Deed {
  volatile int64_t time_ns; /* CLOCK_MONOTONIC */
  volatile int64_t source;  /* inode of an attribute; -1 - number of a line */
  volatile int64_t value;
  volatile int64_t number; /* its own, from 1; set after the other members */
};
struct Switches {
  volatile int64_t clock_offset_s;
  volatile int64_t disk_full;
  volatile int64_t disk_slow_ms;
  volatile int64_t deeds_begun;
  volatile int64_t level[LINES];
  volatile int64_t refused[LINES];
  struct Deed deeds[DEEDS];
  volatile int64_t disk_hangs; /* for which files, bits as in kHanging */
  volatile int64_t hung_calls; /* number of waiting calls */
  volatile int64_t disk_slows; /* for which files, bits as in kHanging */
  volatile int64_t slow_ms;    /* duration of each call */
  volatile int64_t slow_calls; /* number of slow calls */
};
static struct Switches none;
static struct Switches* switches = &none;

__attribute__((constructor)) static void attach(void) {
  const char* path = getenv("LOOPWARDEN_FAULTS");
  const int fd = path ? open(path, O_RDWR | O_CLOEXEC) : -1;
  if (fd < 0) return;
  void* map = mmap(NULL, sizeof none, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
  close(fd);
  if (map != MAP_FAILED) switches = map;
}

#define REAL(name)               \
  static __typeof__(&name) real; \
  if (!real) real = (__typeof__(&name))dlsym(RTLD_NEXT, #name)

static void note(int64_t source, int64_t value) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  const int64_t number = __atomic_add_fetch(&switches->deeds_begun, 1, __ATOMIC_RELAXED);
  struct Deed* deed = &switches->deeds[number % DEEDS];
  deed->time_ns = now.tv_sec * 1000000000LL + now.tv_nsec;
  deed->source = source;
  deed->value = value;
  __atomic_store_n(&deed->number, number, __ATOMIC_RELEASE);
}

static const char* const kHanging[] = {"/segments",    "/records",      "/journal.sqlite",
                                       "/alarm-state", "/evidence",     "/metrics.prom",
                                       "/log",         "/store.sqlite", "/notifications.sqlite"};
static const int kBit[] = {0, 1, 2, 2, 3, 4, 5, 6, 7};

static int64_t mask_of(const char* path) {
  int64_t mask = 0;
  for (unsigned i = 0; i < sizeof kBit / sizeof kBit[0]; ++i) {
    if (strstr(path, kHanging[i])) mask |= (int64_t)1 << kBit[i];
  }
  return mask;
}

static void wait_for(const char* path) {
  const int64_t mask = mask_of(path);
  if (!(switches->disk_hangs & mask)) return;
  const struct timespec pause = {0, 5000000};
  __atomic_add_fetch(&switches->hung_calls, 1, __ATOMIC_RELAXED);
  while (switches->disk_hangs & mask) nanosleep(&pause, NULL);
  __atomic_add_fetch(&switches->hung_calls, -1, __ATOMIC_RELAXED);
}

static void take_time_for(const char* path) {
  if (!(switches->disk_slows & mask_of(path))) return;
  const struct timespec pause = {switches->slow_ms / 1000, switches->slow_ms % 1000 * 1000000};
  nanosleep(&pause, NULL);
  __atomic_add_fetch(&switches->slow_calls, 1, __ATOMIC_RELAXED);
}

static void wait_for_name(const char* path) {
  if (switches->disk_hangs) wait_for(path);
  if (switches->disk_slows) take_time_for(path);
}

/* Returns its path; empty if it has none. */
static const char* name_of(int fd, char* path, size_t size) {
  char link[64];
  snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
  const ssize_t length = readlink(link, path, size - 1);
  path[length > 0 ? length : 0] = '\0';
  return path;
}

static void wait_for_file(int fd) {
  char path[4096];
  if (switches->disk_hangs) wait_for(name_of(fd, path, sizeof path));
}

static void take_time_to_sync(int fd) {
  char path[4096];
  if (switches->disk_slows) take_time_for(name_of(fd, path, sizeof path));
}

static int refused(int fd) {
  struct stat s;
  wait_for_file(fd);
  if (!switches->disk_full && !switches->disk_slow_ms) return 0;
  if (fstat(fd, &s) != 0 || !S_ISREG(s.st_mode)) return 0;
  if (switches->disk_slow_ms) {
    const struct timespec pause = {switches->disk_slow_ms / 1000,
                                   switches->disk_slow_ms % 1000 * 1000000};
    nanosleep(&pause, NULL);
  }
  if (!switches->disk_full) return 0;
  errno = ENOSPC;
  return 1;
}

static int is_attribute(int fd, struct stat* s) {
  return fstat(fd, s) == 0 && S_ISREG(s->st_mode) && (s->st_mode & S_ISVTX);
}

int clock_gettime(clockid_t clock, struct timespec* now) {
  REAL(clock_gettime);
  const int result = real(clock, now);
  if (result == 0 && clock == CLOCK_REALTIME) now->tv_sec += switches->clock_offset_s;
  return result;
}
int open(const char* path, int flags, ...) {
  REAL(open);
  va_list more;
  va_start(more, flags);
  const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) ? va_arg(more, mode_t) : 0;
  va_end(more);
  wait_for_name(path);
  return real(path, flags, mode);
}
int open64(const char* path, int flags, ...) {
  REAL(open64);
  va_list more;
  va_start(more, flags);
  const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) ? va_arg(more, mode_t) : 0;
  va_end(more);
  wait_for_name(path);
  return real(path, flags, mode);
}
int openat(int folder, const char* path, int flags, ...) {
  REAL(openat);
  va_list more;
  va_start(more, flags);
  const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) ? va_arg(more, mode_t) : 0;
  va_end(more);
  wait_for_name(path);
  return real(folder, path, flags, mode);
}
DIR* opendir(const char* path) {
  REAL(opendir);
  wait_for_name(path);
  return real(path);
}
int rename(const char* from, const char* to) {
  REAL(rename);
  wait_for_name(to);
  return real(from, to);
}
int mkdir(const char* path, mode_t mode) {
  REAL(mkdir);
  wait_for_name(path);
  return real(path, mode);
}
ssize_t write(int fd, const void* data, size_t size) {
  REAL(write);
  return refused(fd) ? -1 : real(fd, data, size);
}
ssize_t writev(int fd, const struct iovec* parts, int count) {
  REAL(writev);
  return refused(fd) ? -1 : real(fd, parts, count);
}
ssize_t pread(int fd, void* data, size_t size, off_t at) {
  REAL(pread);
  struct stat s;
  const struct timespec pause = {0, 5000000};
  while (is_attribute(fd, &s) && s.st_nlink != 0 && !(s.st_mode & S_IROTH)) nanosleep(&pause, NULL);
  if (is_attribute(fd, &s) && (s.st_nlink == 0 || !(s.st_mode & S_IRUSR))) {
    errno = s.st_nlink == 0 ? ENODEV : EIO;
    return -1;
  }
  return real(fd, data, size, at);
}
ssize_t pwrite(int fd, const void* data, size_t size, off_t at) {
  REAL(pwrite);
  struct stat s;
  if (!is_attribute(fd, &s)) return refused(fd) ? -1 : real(fd, data, size, at);
  if (s.st_nlink == 0 || !(s.st_mode & S_IWUSR)) {
    errno = s.st_nlink == 0 ? ENODEV : EIO;
    return -1;
  }
  if (!(s.st_mode & S_IWGRP)) return (ssize_t)size;
  const ssize_t written = real(fd, data, size, at);
  char text[32] = "";
  if (written > 0 && written < (ssize_t)sizeof text) {
    __builtin_memcpy(text, data, (size_t)written);
    note((int64_t)s.st_ino, strtoll(text, NULL, 10));
  }
  return written;
}
ssize_t pwrite64(int fd, const void* data, size_t size, off64_t at) {
  REAL(pwrite64);
  return refused(fd) ? -1 : real(fd, data, size, at);
}
int fsync(int fd) {
  REAL(fsync);
  take_time_to_sync(fd);
  return refused(fd) ? -1 : real(fd);
}
int fdatasync(int fd) {
  REAL(fdatasync);
  take_time_to_sync(fd);
  return refused(fd) ? -1 : real(fd);
}
int posix_fallocate(int fd, off_t at, off_t size) {
  REAL(posix_fallocate);
  return refused(fd) ? ENOSPC : real(fd, at, size);
}

/* Lines are found by their names, "line0" to "line15". */
struct gpiod_chip {
  int nothing;
};
struct gpiod_line {
  int requested, inverted;
};
static struct gpiod_chip chip;
static struct gpiod_line lines[LINES];

static long index_of(const struct gpiod_line* line) { return line - lines; }

static int request(struct gpiod_line* line, int flags) {
  enum { ACTIVE_LOW = 1 << 2 };
  if (switches->refused[index_of(line)] || line->requested) {
    errno = line->requested ? EBUSY : ENODEV;
    return -1;
  }
  line->requested = 1;
  line->inverted = (flags & ACTIVE_LOW) != 0;
  return 0;
}

struct gpiod_line* gpiod_line_find(const char* name) {
  unsigned number = LINES;
  if (sscanf(name, "line%u", &number) == 1 && number < LINES) return &lines[number];
  errno = ENOENT;
  return NULL;
}
struct gpiod_chip* gpiod_line_get_chip(struct gpiod_line* line) {
  (void)line;
  return &chip;
}
void gpiod_chip_close(struct gpiod_chip* closed) { (void)closed; }
void gpiod_line_release(struct gpiod_line* line) { line->requested = 0; }
int gpiod_line_get_value(struct gpiod_line* line) {
  if (switches->refused[index_of(line)]) {
    errno = EIO;
    return -1;
  }
  return (switches->level[index_of(line)] != 0) ^ line->inverted;
}
int gpiod_line_set_value(struct gpiod_line* line, int value) {
  if (switches->refused[index_of(line)]) {
    errno = EIO;
    return -1;
  }
  switches->level[index_of(line)] = (value != 0) ^ line->inverted;
  note(-1 - index_of(line), switches->level[index_of(line)]);
  return 0;
}
int gpiod_line_request_input_flags(struct gpiod_line* line, const char* consumer, int flags) {
  (void)consumer;
  return request(line, flags);
}
int gpiod_line_request_output_flags(struct gpiod_line* line, const char* consumer, int flags,
                                    int value) {
  (void)consumer;
  return request(line, flags) == 0 ? gpiod_line_set_value(line, value) : -1;
}
