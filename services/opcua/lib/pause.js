// SPDX-License-Identifier: Apache-2.0
// How long to wait after the `attempts`th attempt has failed, from 1 on: doubling, with a random part, as base/back_off.hpp.
export function pause(attempts, { first, longest }, chance = Math.random()) {
  const whole = Math.min(longest, first * 2 ** Math.min(attempts - 1, 30));
  return whole / 2 + (chance * whole) / 2;
}
