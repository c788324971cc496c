// SPDX-License-Identifier: Apache-2.0
// Plays sounds and shows notifications. Both need a click or key of the user first.

let audio = null;

// Enables sound after a click or key, because browsers let no page sound without one. changed(): whether sound is allowed has changed, also because
// the browser revoked it. Has no effect in a browser without sound.
export async function allowSound(changed = () => {}) {
  try {
    if (!audio) {
      audio = new AudioContext();
      audio.addEventListener('statechange', changed);
    }
    await audio.resume();
  } catch {
    // maySound() returns whether sound is allowed.
  }
}

export const maySound = () => audio?.state === 'running';
export const mayNotify = () => globalThis.Notification?.permission === 'granted';
export const askToNotify = async () => { if (globalThis.Notification?.permission === 'default') await Notification.requestPermission(); };

// Two tones, the second higher: audible near machines, and no spoken word.
export function sound() {
  if (!maySound()) return false;
  [[0, 660], [0.22, 880]].forEach(([after_s, hertz]) => {
    const tone = audio.createOscillator(), loud = audio.createGain(), begin = audio.currentTime + after_s;
    tone.frequency.value = hertz;
    loud.gain.setValueAtTime(0.0001, begin);
    loud.gain.exponentialRampToValueAtTime(0.3, begin + 0.02);
    loud.gain.exponentialRampToValueAtTime(0.0001, begin + 0.2);
    tone.connect(loud).connect(audio.destination);
    tone.start(begin);
    tone.stop(begin + 0.21);
  });
  return true;
}

export function notify({title, body, key, href}) {
  if (!mayNotify()) return;
  try {
    const note = new Notification(title, {body, tag: key});
    note.onclick = () => {
      window.focus();
      location.hash = href;
      note.close();
    };
  } catch {
    // Chrome on Android accepts notifications only from service workers.
  }
}
