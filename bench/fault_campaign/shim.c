/* SPDX-License-Identifier: Apache-2.0
 * Loaded into the daemon under test (LD_PRELOAD): a disk that is full or slow and a wall clock that
 * jumps, switched by a small file that the campaign maps as well. Only regular files are affected.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

struct Switches {
  volatile int64_t clock_offset_s;
  volatile int64_t disk_full;
  volatile int64_t disk_slow_ms;
};
static struct Switches none;
static struct Switches* switches = &none;

__attribute__((constructor)) static void attach(void) {
  const char* path = getenv("LOOPWARDEN_FAULTS");
  const int fd = path ? open(path, O_RDWR | O_CLOEXEC) : -1;
  if (fd < 0) return;
  void* map = mmap(NULL, sizeof none, PROT_READ, MAP_SHARED, fd, 0);
  close(fd);
  if (map != MAP_FAILED) switches = map;
}

static int refused(int fd) {
  struct stat s;
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

#define REAL(name) \
  static __typeof__(&name) real; \
  if (!real) real = (__typeof__(&name))dlsym(RTLD_NEXT, #name)

int clock_gettime(clockid_t clock, struct timespec* now) {
  REAL(clock_gettime);
  const int result = real(clock, now);
  if (result == 0 && clock == CLOCK_REALTIME) now->tv_sec += switches->clock_offset_s;
  return result;
}
ssize_t write(int fd, const void* data, size_t size) {
  REAL(write);
  return refused(fd) ? -1 : real(fd, data, size);
}
ssize_t writev(int fd, const struct iovec* parts, int count) {
  REAL(writev);
  return refused(fd) ? -1 : real(fd, parts, count);
}
ssize_t pwrite(int fd, const void* data, size_t size, off_t at) {
  REAL(pwrite);
  return refused(fd) ? -1 : real(fd, data, size, at);
}
ssize_t pwrite64(int fd, const void* data, size_t size, off64_t at) {
  REAL(pwrite64);
  return refused(fd) ? -1 : real(fd, data, size, at);
}
int fsync(int fd) {
  REAL(fsync);
  return refused(fd) ? -1 : real(fd);
}
int fdatasync(int fd) {
  REAL(fdatasync);
  return refused(fd) ? -1 : real(fd);
}
int posix_fallocate(int fd, off_t at, off_t size) {
  REAL(posix_fallocate);
  return refused(fd) ? ENOSPC : real(fd, at, size);
}
