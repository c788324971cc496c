/* SPDX-License-Identifier: Apache-2.0
 * A step-by-step model of base/spsc_ring.hpp: every read or write of an atomic, and the copy of an
 * item, is a separate step. The counters run modulo a small number, so that they wrap.
 * spin explores all interleavings of sequentially consistent steps. It does not check that release
 * and acquire order the copy before its counter: the header argues this, and ThreadSanitizer tests it.
 */
#define CAPACITY 2
#define WRAP 8 /* a multiple of the capacity, as 2^64 is */
#define ITEMS 6

byte items[CAPACITY];
byte head = WRAP - 3, tail = WRAP - 3;
bool writing[CAPACITY], reading[CAPACITY];
byte pushed = 0, dropped = 0, taken = 0;
byte last = 0;
bool done = false;

#define USED(a, b) ((a + WRAP - b) % WRAP)

proctype writer() {
  byte h, cached_tail = WRAP - 3, number = 1;
  do
  :: number > ITEMS -> break
  :: else ->
    h = head;
    if
    :: USED(h, cached_tail) >= CAPACITY -> cached_tail = tail
    :: else
    fi;
    if
    :: USED(h, cached_tail) >= CAPACITY -> dropped++
    :: else ->
      writing[h % CAPACITY] = true;
      assert(!reading[h % CAPACITY]);
      items[h % CAPACITY] = number;
      writing[h % CAPACITY] = false;
      pushed++;
      head = (h + 1) % WRAP
    fi;
    number++
  od;
  done = true
}

proctype reader() {
  byte t, cached_head = WRAP - 3, item;
  bool ended;
  do
  :: ended = done;
    t = tail;
    if
    :: t == cached_head -> cached_head = head
    :: else
    fi;
    if
    :: t == cached_head -> if :: ended -> break :: else fi
    :: else ->
      reading[t % CAPACITY] = true;
      assert(!writing[t % CAPACITY]);
      item = items[t % CAPACITY];
      reading[t % CAPACITY] = false;
      assert(item > last); /* in order, none twice */
      last = item;
      taken++;
      tail = (t + 1) % WRAP
    fi
  od;
  assert(taken == pushed && pushed + dropped == ITEMS) /* none lost but what was counted */
}

init { atomic { run writer(); run reader() } }
