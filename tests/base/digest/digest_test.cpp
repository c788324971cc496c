// SPDX-License-Identifier: Apache-2.0
#include "base/digest/digest.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace digest_test {

using namespace loopwarden::base;

TEST_CASE("bytes in hexadecimal", "[digest]") {
  CHECK(to_hex(std::array<std::uint8_t, 3>{0x00, 0x9F, 0xFA}) == "009ffa");
  CHECK(to_hex({}).empty());
}

TEST_CASE("SHA-256 of the standard's example, of a text and of a file", "[digest]") {
  const std::string expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
  CHECK(sha256_hex("abc") == expected);
  const loopwarden::tests::TemporaryFolder folder;
  loopwarden::tests::write_file(folder / "file", "abc");
  CHECK(sha256_hex_of_file(folder / "file") == expected);
  // More than one read returns.
  const std::string large(200'000, 'x');
  loopwarden::tests::write_file(folder / "large", large);
  CHECK(sha256_hex_of_file(folder / "large") == sha256_hex(large));
  CHECK_THROWS_AS(sha256_hex_of_file(folder / "none"), std::runtime_error);
}

TEST_CASE("HMAC-SHA-256 of RFC 4231", "[digest]") {
  CHECK(hmac_sha256_hex("Jefe", "what do ya want for nothing?") ==
        "5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843");
}

TEST_CASE("CRC-32 as in IEEE 802.3, at once or in parts", "[digest]") {
  const std::string text = "123456789";
  CHECK(crc32(text) == 0xCBF43926U);
  CHECK(crc32({}) == 0U);
  CHECK(crc32(std::span(text).subspan(4), crc32(std::span(text).first(4))) == 0xCBF43926U);
  CHECK(crc32({}, 17) == 17U);
}

}  // namespace digest_test
