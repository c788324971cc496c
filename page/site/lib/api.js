// SPDX-License-Identifier: Apache-2.0
// Requests to the page's own server.

export class ApiError extends Error {
  constructor(status, message, body = {}) {
    super(message);
    this.status = status;
    this.body = body;
  }
}

let csrf = '';
export const keepCsrf = (token) => { csrf = token; };

async function answer(response) {
  let body = {};
  try {
    body = await response.json();
  } catch {
    // An answer without JSON says as much as its status.
  }
  if (response.ok) return body;
  const wait = response.headers.get('Retry-After');
  throw new ApiError(response.status, body.error || `HTTP ${response.status}`, wait ? {...body, retry_s: Number(wait)} : body);
}

export async function get(path, signal) {
  return answer(await fetch(path, {signal, headers: {Accept: 'application/json'}, credentials: 'same-origin'}));
}

export async function post(path, body, signal) {
  return answer(await fetch(path, {
    method: 'POST', signal, credentials: 'same-origin', body: JSON.stringify(body),
    headers: {'Content-Type': 'application/json', 'X-CSRF-Token': csrf, Accept: 'application/json'},
  }));
}

export const loopPath = (tag, ...more) => ['/api/loops', tag, ...more].map((part, i) => (i ? encodeURIComponent(part) : part)).join('/');

// "?a=1&b=2" of what has a value.
export function query(values) {
  const pairs = Object.entries(values).filter(([, value]) => value !== null && value !== undefined && value !== '');
  return pairs.length ? `?${new URLSearchParams(pairs)}` : '';
}
