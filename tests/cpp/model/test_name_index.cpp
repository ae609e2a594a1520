#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "linkwise/model/name_index.hpp"

namespace linkwise {
namespace {

TEST(NameIndex, FindsEveryNameAndNoOther) {
  NameIndex index;
  std::vector<std::string> names;
  const auto name_of = [&](int i) -> const std::string& { return names[i]; };
  EXPECT_EQ(index.find("anything", name_of), -1);
  for (int n : {0, 1, 2, 3, 1000}) {
    names.clear();
    index.reset(n);
    for (int i = 0; i < n; ++i) {
      names.push_back("joint_" + std::to_string(i));
      EXPECT_TRUE(index.insert(i, name_of));
    }
    for (int i = 0; i < n; ++i) EXPECT_EQ(index.find(names[i], name_of), i);
    EXPECT_EQ(index.find("joint_" + std::to_string(n), name_of), -1);
    EXPECT_EQ(index.find("", name_of), -1);
  }
  names[3] = names[998];
  NameIndex again;
  again.reset(1000);
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(again.insert(i, name_of), i != 998) << i;
  EXPECT_EQ(again.find(names[998], name_of), 3);
}

}  // namespace
}  // namespace linkwise
