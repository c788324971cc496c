/* SPDX-License-Identifier: Apache-2.0
 * A step-by-step model of base/newest_value.hpp: three slots, and one shared byte that both sides
 * exchange. spsc_ring.pml describes the limits of such a model.
 */
#define FRESH 128
#define VALUES 5

byte slots[3];
bool writing[3], reading[3];
byte shared = 2;
byte newest = 0;
bool done = false;

proctype writer() {
  byte own = 0, previous, value = 1;
  do
  :: value > VALUES -> break
  :: else ->
    writing[own] = true;
    assert(!reading[own]);
    slots[own] = value;
    writing[own] = false;
    newest = value;
    d_step { previous = shared; shared = own | FRESH };
    own = previous & 3;
    value++
  od;
  done = true
}

proctype reader() {
  byte own = 1, previous, last = 0, value;
  bool ended;
  do
  :: ended = done;
    if
    :: (shared & FRESH) ->
      d_step { previous = shared; shared = own };
      own = previous & 3;
      reading[own] = true;
      assert(!writing[own]);
      value = slots[own];
      reading[own] = false;
      assert(value > last && value <= newest); /* never older than what was seen */
      last = value
    :: else ->
      if :: ended -> break :: else fi
    fi
  od;
  assert(last == VALUES) /* the newest is not lost */
}

init { atomic { run writer(); run reader() } }
