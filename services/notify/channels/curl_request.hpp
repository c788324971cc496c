// SPDX-License-Identifier: Apache-2.0
// A transfer by libcurl with the settings that all channels share: time-outs, checked certificates,
// an early end if the program quits, and no signals.
#pragma once

#include <curl/curl.h>

#include <array>
#include <atomic>
#include <memory>
#include <string>

#include "services/notify/channels/channel_settings.hpp"

namespace loopwarden::notify {

class CurlRequest {
 public:
  // `protocols`: the allowed ones, as libcurl names them. A URL with another protocol is refused.
  CurlRequest(const std::string& url, const char* protocols, const TlsFiles& tls,
              const TimeOuts& time_outs);
  CurlRequest(const CurlRequest&) = delete;
  CurlRequest& operator=(const CurlRequest&) = delete;

  template <class T>
  void set(CURLoption option, T value) {
    check(curl_easy_setopt(handle_.get(), option, value));
  }
  void set(CURLoption option, const std::string& text) { set(option, text.c_str()); }
  // Appends a header line or a recipient to the list of `option`.
  void append(CURLoption option, const std::string& line);

  CURLcode perform(const std::atomic<bool>& quit);
  long response_code() const;
  // Returns the error as text. Call it after perform().
  std::string error(CURLcode code) const;
  CURL* handle() noexcept { return handle_.get(); }

 private:
  static void check(CURLcode code);
  static int progress(void* quit, curl_off_t, curl_off_t, curl_off_t, curl_off_t) noexcept;

  std::unique_ptr<CURL, void (*)(CURL*)> handle_;
  std::unique_ptr<curl_slist, void (*)(curl_slist*)> list_{nullptr, curl_slist_free_all};
  std::array<char, CURL_ERROR_SIZE> error_{};
};

}  // namespace loopwarden::notify
