// The digests are those of FIPS 180-4's examples and of sha256sum.

#include "unflex/core/sha256.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace unflex {
namespace {

TEST(Sha256, GivesTheStandardsExamples) {
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256(std::string(1'000'000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, DoesNotDependOnHowTheBytesCome) {
  std::string bytes;
  for (int i = 0; i < 300; ++i) {
    bytes += static_cast<char>(i * 7);
  }
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    const std::string whole = sha256(std::string_view(bytes).substr(0, length));
    for (const std::size_t step : {1UL, 63UL, 64UL, 65UL}) {
      Sha256 hash;
      for (std::size_t at = 0; at < length; at += step) {
        hash.add(std::string_view(bytes).substr(at, std::min(step, length - at)));
      }
      EXPECT_EQ(hash.finish(), whole) << length << " bytes in steps of " << step;
    }
  }
}

}  // namespace
}  // namespace unflex
