#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Bytes that an ext4 file system writes to its disk for each byte of rows, by the way in which a recorder writes them.

Each method runs on a separate file system on a loop device, all at the same time, in real time. The kernel counts the
sectors that are written: data and metadata. Needs root.

  each       every row at once, and one fdatasync for each file (the recorder before 0.3)
  waiting    rows wait in memory until the sync, and one fdatasync for each file
  together   also: the data of all files are on their way before the first fdatasync
  allocated  also: the space of a file is allocated when it begins (the recorder: record/segment_ring.cpp)

Example: lab/bench/write_methods.py --loops 12 --sync 5 60
"""
import argparse
import ctypes
import multiprocessing
import os
import shutil
import subprocess
import sys
import tempfile
import time

METHODS = ("each", "waiting", "together", "allocated")
ROW_BYTES = 88
HEADER_BYTES = 512
SEGMENT_BYTES = 1 << 20
SECTOR = 512
DISK_BYTES = 1 << 30
SETTLE_S = 7  # ext4 stores changed metadata within 5 s
KEEP_SIZE = 1  # fallocate(2)
WRITE_AND_WAIT = 1 | 2 | 4  # sync_file_range(2)
DAY_S = 86400

libc = ctypes.CDLL(None, use_errno=True)


class Files:
    def __init__(self, folder, loops, method):
        self.method = method
        self.position = [HEADER_BYTES] * loops
        self.waiting = [b""] * loops
        self.files = []
        for i in range(loops):
            os.makedirs(f"{folder}/segments/FIC-{101 + i}")
            file = os.open(f"{folder}/segments/FIC-{101 + i}/0000000001.lwseg", os.O_WRONLY | os.O_CREAT)
            if method == "allocated":
                libc.fallocate(file, KEEP_SIZE, ctypes.c_int64(0), ctypes.c_int64(SEGMENT_BYTES))
            os.write(file, b"h" * HEADER_BYTES)
            self.files.append(file)

    def take(self, i, row):
        self.waiting[i] += row
        if self.method == "each":
            self.write(i)

    def write(self, i):
        os.pwrite(self.files[i], self.waiting[i], self.position[i])
        self.position[i] += len(self.waiting[i])
        self.waiting[i] = b""

    def sync(self):
        for i in range(len(self.files)):
            self.write(i)
        if self.method in ("together", "allocated"):
            for file in self.files:
                libc.sync_file_range(file, ctypes.c_int64(0), ctypes.c_int64(0), ctypes.c_uint(WRITE_AND_WAIT))
        for file in self.files:
            os.fdatasync(file)


def run(task):
    method, loops, sync_s, syncs, folder = task
    with open(folder + ".img", "wb") as image:
        image.truncate(DISK_BYTES)
    subprocess.run(["mkfs.ext4", "-q", "-b", "4096", folder + ".img"], check=True)
    subprocess.run(["mount", "-o", "loop", folder + ".img", folder], check=True)
    try:
        device = os.stat(folder).st_dev
        counter = f"/sys/dev/block/{os.major(device)}:{os.minor(device)}/stat"

        def written():
            with open(counter, encoding="ascii") as file:
                return int(file.read().split()[6]) * SECTOR

        files = Files(folder, loops, method)
        os.sync()
        time.sleep(SETTLE_S)
        before, begin = written(), time.monotonic()
        for second in range(1, int(sync_s * syncs) + 1):
            time.sleep(max(0.0, begin + second - time.monotonic()))
            for i in range(loops):
                files.take(i, os.urandom(ROW_BYTES))
            if second % sync_s == 0:
                files.sync()
        time.sleep(SETTLE_S)
        rows = int(sync_s * syncs) * loops * ROW_BYTES
        return method, sync_s, (written() - before) / rows
    finally:
        subprocess.run(["umount", "--lazy", folder], check=False)
        os.unlink(folder + ".img")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--loops", type=int, default=12, help="each has a row per second")
    parser.add_argument("--sync", type=int, nargs="+", default=[5, 60], help="s between two syncs")
    parser.add_argument("--seconds", type=int, default=180)
    options = parser.parse_args()
    if os.geteuid() != 0:
        sys.exit("needs root, to mount file systems")
    work = tempfile.mkdtemp(prefix="loopwarden-writes-")
    tasks = []
    for sync_s in options.sync:
        for method in METHODS:
            folder = f"{work}/{method}-{sync_s}"
            os.mkdir(folder)
            tasks.append((method, options.loops, sync_s, max(1, options.seconds // sync_s), folder))
    day_mb = options.loops * ROW_BYTES * DAY_S / 1e6
    print(f"{options.loops} loops at 1 s: {day_mb:.0f} MB of rows a day")
    print("| method | sync, s | times the rows | MB a day |\n|---|---|---|---|")
    try:
        with multiprocessing.Pool(len(tasks)) as pool:
            for method, sync_s, times in pool.imap(run, tasks):
                print(f"| {method} | {sync_s} | {times:.1f} | {times * day_mb:.0f} |", flush=True)
    finally:
        shutil.rmtree(work, ignore_errors=True)


if __name__ == "__main__":
    main()
