#include "protocol/frame/sha256.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <string>
#include <string_view>

#include "random_bytes.hpp"

namespace probebox::frame {
namespace {

std::string sha256Of(std::string_view text) {
  Sha256 hash;
  hash.add(std::as_bytes(std::span{text}));
  constexpr std::string_view kHex = "0123456789abcdef";
  std::string all;
  for (const auto byte : hash.digest()) all.append({kHex[byte >> 4U], kHex[byte & 15U]});
  return all;
}

// The examples of NIST's CAVP and FIPS 180-4.
TEST(Sha256, AgreesWithNist) {
  EXPECT_EQ(sha256Of(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256Of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256Of("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256Of(std::string(1'000'000, 'a')), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, OfPiecesIsThatOfTheWhole) {
  EXPECT_TRUE(rc::check("any cut gives the same digest", [] {
    const auto pieces = *rc::gen::container<std::vector<std::string>>(rc::gen::arbitrary<std::string>());
    std::string whole;
    Sha256 hash;
    for (const auto& piece : pieces) {
      whole += piece;
      hash.add(std::as_bytes(std::span{piece}));
    }
    Sha256 at_once;
    at_once.add(std::as_bytes(std::span{whole}));
    RC_ASSERT(hash.digest() == at_once.digest());
  }));
}

// Every length around the ends of a block, against lengths that end otherwise: padding of 1 to 72 bytes.
TEST(Sha256, DiffersByLength) {
  std::set<std::string> digests;
  for (std::size_t length = 0; length < 200; ++length) digests.insert(sha256Of(std::string(length, '\0')));
  EXPECT_EQ(digests.size(), 200U);
  EXPECT_EQ(sha256Of(std::string(55, 'a')), "9f4390f8d30c2dd92ec9f095b65e2b9ae9b0a925a5258e241c9f1e910f734318");
  EXPECT_EQ(sha256Of(std::string(56, 'a')), "b35439a4ac6f0948b6d6f9e3c6af0f5f590ce20f1bde7090ef7970686ec6738a");
  EXPECT_EQ(sha256Of(std::string(64, 'a')), "ffe054fe7ae0cb6dc65c3af9b61d5209f439851db43d0ba5997337df154668eb");
}

}  // namespace
}  // namespace probebox::frame
