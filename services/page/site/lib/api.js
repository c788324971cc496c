// SPDX-License-Identifier: Apache-2.0
// Sends requests to the page's own server.
import {person} from './person.js';

export class ApiError extends Error {
  constructor(status, message, body = {}) {
    super(message);
    this.status = status;
    this.body = body;
  }
}

let csrf = '';
export const keepCsrf = (token) => { csrf = token; };

// Called when an answer reports that the session has ended.
export const onLost = {act: () => {}};

async function answer(response) {
  let body = {};
  try {
    body = await response.json();
  } catch {
    // Without JSON in the answer, its status is the message.
  }
  if (response.ok) return body;
  const wait = response.headers.get('Retry-After');
  throw new ApiError(response.status, body.error || `HTTP ${response.status}`, wait ? {...body, retry_s: Number(wait)} : body);
}

async function ask(path, options) {
  const response = await fetch(path, {...options, credentials: 'same-origin', headers: {...options.headers, ...person.headers(performance.now()), Accept: 'application/json'}});
  // A wrong password is not the end of a session.
  if (response.status === 401 && path !== '/api/login') onLost.act();
  return answer(response);
}

export const get = (path, signal) => ask(path, {signal});

export const post = (path, body, signal) => ask(path, {method: 'POST', signal, body: JSON.stringify(body),
  headers: {'Content-Type': 'application/json', 'X-CSRF-Token': csrf}});

export const loopPath = (tag, ...more) => ['/api/loops', tag, ...more].map((part, i) => (i ? encodeURIComponent(part) : part)).join('/');

// Returns "?a=1&b=2" for the members that have a value.
export function query(values) {
  const pairs = Object.entries(values).filter(([, value]) => value !== null && value !== undefined && value !== '');
  return pairs.length ? `?${new URLSearchParams(pairs)}` : '';
}
