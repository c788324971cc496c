// SPDX-License-Identifier: Apache-2.0
// A transfer by libcurl with what all of ours have in common: time-outs, certificates that are checked, an early end
// where the program quits, and no signals.
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
  // `protocols` as libcurl names them: nothing else is spoken, whatever the URL says.
  CurlRequest(const std::string& url, const char* protocols, const TlsFiles& tls,
              const TimeOuts& time_outs);
  CurlRequest(const CurlRequest&) = delete;
  CurlRequest& operator=(const CurlRequest&) = delete;

  template <class T>
  void set(CURLoption option, T value) {
    check(curl_easy_setopt(handle_.get(), option, value));
  }
  void set(CURLoption option, const std::string& text) { set(option, text.c_str()); }
  // A header line, or a recipient, of the list of that option.
  void append(CURLoption option, const std::string& line);

  CURLcode perform(const std::atomic<bool>& quit);
  long response_code() const;
  // In words, after perform().
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
