// SPDX-License-Identifier: Apache-2.0
#include "services/net/http/tls.hpp"

#include <catch2/catch.hpp>
#include <sys/stat.h>

#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::tls_test {

using namespace http;

unsigned mode_of(const std::filesystem::path& path) {
  struct stat status {};
  REQUIRE(::stat(path.c_str(), &status) == 0);
  return status.st_mode & 0777U;
}

TEST_CASE("a certificate on request, with a key that only its owner reads") {
  const TemporaryFolder folder;
  const auto files =
      write_self_signed(make_self_signed({"Box.plant", "10.0.0.5", "::1"}, 30), folder.path());
  CHECK(mode_of(files.key) == 0600);
  CHECK(mode_of(files.certificate) == 0644);
  CHECK(names_in_certificate(files.certificate) == std::vector<std::string>{"box.plant"});
  SSL_CTX* context = make_tls_context(files);
  CHECK(SSL_CTX_get_min_proto_version(context) == TLS1_2_VERSION);
  SSL_CTX_free(context);
  SECTION("no file is replaced") {
    CHECK_THROWS(write_self_signed(make_self_signed({"box"}, 30), folder.path()));
  }
  SECTION("a key of another certificate is refused") {
    write_file(files.key, make_self_signed({"box"}, 30).key);
    CHECK_THROWS(make_tls_context(files));
  }
}

TEST_CASE("an invalid host gives no certificate") {
  const char* const host = GENERATE("", "a b", "x,IP:1.2.3.4", "a\nb", "*", "section:@x/../");
  CHECK_THROWS(make_self_signed({host}, 30));
}

}  // namespace loopwarden::tests::tls_test
