#include "formats/access/location.h"

#include <gtest/gtest.h>

#include "formats/error.h"

namespace cairn::formats {
namespace {

TEST(Location, PathsStayPaths) {
  for (const char* path : {"site.cairn", "/data/site.cairn", "http:/site.cairn",
                           "ftp://host/site.cairn", "httpx://h"}) {
    EXPECT_FALSE(Location(path).is_remote()) << path;
    EXPECT_EQ(Location(path).path(), path);
  }
  EXPECT_EQ(Location("a/site.cairn/").name(), "site.cairn");
}

TEST(Location, AddressesNameFoldersAndFiles) {
  const Location location("HTTPS://host:8080/a/site%20one.cairn//");
  EXPECT_TRUE(location.is_remote());
  EXPECT_EQ(location.file("index.bin").string(), "https://host:8080/a/site%20one.cairn/index.bin");
  EXPECT_EQ(location.name(), "site%20one.cairn");
  EXPECT_EQ(Location("hTTp://Host/A").path(), "http://Host/A");
  EXPECT_EQ(Location("http://[::1]:80/x").file("nodes.bin").string(),
            "http://[::1]:80/x/nodes.bin");
}

TEST(Location, RefusesAddressesThatCannotBe) {
  for (const char* text :
       {"http://", "http:///site", "http://:80/site", "http://host/a b", "http://host/a\r\nX: y",
        "http://host/site?x=1", "http://host/site#x", "https://me:secret@host/site"}) {
    try {
      Location location{text};
      ADD_FAILURE() << text;
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::kUsage) << text;
      EXPECT_EQ(std::string(error.what()).find("secret"), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace cairn::formats
