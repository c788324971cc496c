// SPDX-License-Identifier: Apache-2.0
// A shared worker: one stream of server-sent events for all tabs of a browser. A browser has six
// connections to a server, and each stream occupies one.
import {KINDS} from './event_stream.js';

const tabs = new Set(); // ports
const newest = new Map(); // kind -> data, for a tab that joins the stream
let source = null;

function tell(message) {
  for (const tab of tabs) tab.postMessage(message);
}

function open() {
  newest.clear();
  source = new EventSource('/api/events');
  for (const kind of KINDS) {
    source.addEventListener(kind, ({data}) => {
      if (kind !== 'describe' && kind !== 'ended') newest.set(kind, data);
      tell({kind, data});
    });
  }
  source.onopen = () => tell({open: true});
  source.onerror = () => {
    if (source.readyState !== EventSource.CLOSED) return; // the browser reconnects
    source = null;
    tell({refused: true});
  };
}

function close() {
  source?.close();
  source = null;
}

// `renew`: the session is another one since the stream was opened.
function join(tab, renew) {
  tabs.add(tab);
  if (renew) close();
  if (!source) { open(); return; }
  if (source.readyState !== EventSource.OPEN) return;
  tab.postMessage({open: true});
  for (const [kind, data] of newest) tab.postMessage({kind, data});
}

function leave(tab) {
  tabs.delete(tab);
  if (!tabs.size) close();
}

addEventListener('connect', ({ports: [tab]}) => {
  tab.onmessage = ({data}) => { if (data.leave) leave(tab); else join(tab, data.renew); };
});
