// SPDX-License-Identifier: Apache-2.0
#include "services/notify/channels/curl_request.hpp"

#include <new>
#include <stdexcept>

#include "services/notify/text/one_line.hpp"

namespace loopwarden::notify {
namespace {

// Prepares libcurl with the first transfer: its TLS has 2 MB, and other channels don't need it.
CURL* new_transfer() {
  static const CURLcode prepared = curl_global_init(CURL_GLOBAL_DEFAULT);
  return prepared == CURLE_OK ? curl_easy_init() : nullptr;
}

}  // namespace

CurlRequest::CurlRequest(const std::string& url, const char* protocols, const TlsFiles& tls,
                         const TimeOuts& time_outs)
    : handle_(new_transfer(), curl_easy_cleanup) {
  if (!handle_) throw std::bad_alloc();
  set(CURLOPT_URL, url);
  set(CURLOPT_PROTOCOLS_STR, protocols);
  set(CURLOPT_NOSIGNAL, 1L);
  set(CURLOPT_CONNECTTIMEOUT_MS, static_cast<long>(time_outs.connect_ms));
  set(CURLOPT_TIMEOUT_MS, static_cast<long>(time_outs.all_ms));
  set(CURLOPT_ERRORBUFFER, error_.data());
  set(CURLOPT_SSLVERSION, static_cast<long>(CURL_SSLVERSION_TLSv1_2));
  set(CURLOPT_NOPROGRESS, 0L);
  set(CURLOPT_XFERINFOFUNCTION, &CurlRequest::progress);
  if (!tls.authorities.empty()) set(CURLOPT_CAINFO, tls.authorities);
  if (!tls.certificate.empty()) {
    set(CURLOPT_SSLCERT, tls.certificate);
    set(CURLOPT_SSLKEY, tls.key);
  }
}

void CurlRequest::check(CURLcode code) {
  if (code == CURLE_OUT_OF_MEMORY) throw std::bad_alloc();
  if (code != CURLE_OK) throw std::runtime_error(curl_easy_strerror(code));
}

void CurlRequest::append(CURLoption option, const std::string& line) {
  curl_slist* longer = curl_slist_append(list_.get(), line.c_str());
  if (longer == nullptr) throw std::bad_alloc();
  static_cast<void>(list_.release());  // `longer` begins with it
  list_.reset(longer);
  set(option, longer);
}

int CurlRequest::progress(void* quit, curl_off_t, curl_off_t, curl_off_t, curl_off_t) noexcept {
  return static_cast<const std::atomic<bool>*>(quit)->load(std::memory_order_relaxed) ? 1 : 0;
}

CURLcode CurlRequest::perform(const std::atomic<bool>& quit) {
  set(CURLOPT_XFERINFODATA, &quit);
  return curl_easy_perform(handle_.get());
}

long CurlRequest::response_code() const {
  long code = 0;
  curl_easy_getinfo(handle_.get(), CURLINFO_RESPONSE_CODE, &code);
  return code;
}

std::string CurlRequest::error(CURLcode code) const {
  if (code == CURLE_ABORTED_BY_CALLBACK) return "the program ends";
  const std::string detail = one_line(error_.data());
  return detail.empty() ? curl_easy_strerror(code) : detail;
}

}  // namespace loopwarden::notify
