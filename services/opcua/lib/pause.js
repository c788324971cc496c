// SPDX-License-Identifier: Apache-2.0
// Returns the wait after `attempts` failed attempts (at least 1): doubling, with a random part, as in base/back_off.hpp.
export function pause(attempts, { first, longest }, chance = Math.random()) {
  const whole = Math.min(longest, first * 2 ** Math.min(attempts - 1, 30));
  return whole / 2 + (chance * whole) / 2;
}
