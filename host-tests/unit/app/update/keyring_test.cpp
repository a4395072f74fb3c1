#include "firmware/app/update/keyring.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace probebox::app {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// Of openssl req -x509; its fingerprint is what openssl x509 -fingerprint -sha256 prints.
const std::string kCertificate = R"(-----BEGIN CERTIFICATE-----
MIIBeTCCAR+gAwIBAgIUTVhjAem6Ni//AsNaTx+hTyhkO6YwCgYIKoZIzj0EAwIw
ETEPMA0GA1UEAwwGYSB0ZXN0MCAXDTI2MTEzMDE2MTk0NloYDzIxMjYxMTA2MTYx
OTQ2WjARMQ8wDQYDVQQDDAZhIHRlc3QwWTATBgcqhkjOPQIBBggqhkjOPQMBBwNC
AATaSIgjq536op0l5UuHh2Yu8O1F4t3hdq+G2Cr0XgzYbu3fY6GyagPn/p12czpS
7ROEoWQAQs5kcPVYw8eaux84o1MwUTAdBgNVHQ4EFgQUF1vxzmrA4kJuDiFHPVms
M1FKfk8wHwYDVR0jBBgwFoAUF1vxzmrA4kJuDiFHPVmsM1FKfk8wDwYDVR0TAQH/
BAUwAwEB/zAKBggqhkjOPQQDAgNIADBFAiBaHGX+Rd3srg0+Ia6s08ojyQAuctKz
2TJ2n18lb6yq1gIhAJhq4uyHzSf6XBz+JXIkbgWSfEN6Ip8x7g5AliwriAmv
-----END CERTIFICATE-----
)";
const std::string kFingerprint = "c05e16b1ea76295cf19806c2c022cfe005e7859f1d9767141369c9c1fb81c87e";

TEST(Keyring, NamesItsCertificatesAsOpensslDoes) {
  EXPECT_THAT(certificateFingerprints(kCertificate), ElementsAre(kFingerprint));
  EXPECT_THAT(certificateFingerprints("a comment\n" + kCertificate + kCertificate),
              ElementsAre(kFingerprint, kFingerprint));
}

TEST(Keyring, PassesOverWhatIsNoCertificate) {
  EXPECT_THAT(certificateFingerprints(""), IsEmpty());
  EXPECT_THAT(certificateFingerprints("-----BEGIN CERTIFICATE-----\nMIIB"), IsEmpty());
  EXPECT_THAT(certificateFingerprints("-----BEGIN PRIVATE KEY-----\nMIIB\n-----END PRIVATE KEY-----\n" + kCertificate),
              ElementsAre(kFingerprint));
}

}  // namespace
}  // namespace probebox::app
