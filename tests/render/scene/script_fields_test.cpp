#include "render/scene/script_fields.h"

#include <gtest/gtest.h>

#include <string>

namespace surflect::scene {
namespace {

std::string dotted(int keys) {
  std::string path = "a";
  for (int i = 1; i < keys; ++i) path += ".a";
  return path;
}

TEST(ShallowToml, NamesTheLineOfWhatIsTooDeep) {
  EXPECT_EQ(tooDeepLine("a.b.c = 1", 1), 1);
  EXPECT_EQ(tooDeepLine("a.b = 1\n\n[a.b]\n", 1), 3);
  EXPECT_EQ(tooDeepLine("x = 1\n[[a . b]]", 1), 2);
  EXPECT_EQ(tooDeepLine("x = [1, [2]]", 1), 1);
  EXPECT_EQ(tooDeepLine("x = { y = 1,\n z.a = 2 }", 1), 2);
  EXPECT_EQ(tooDeepLine("x = [\n 1,\n { y = [2] }]", 2), 3);
  EXPECT_EQ(tooDeepLine("1.2.3 = 4", 1), 1); // keys, not a number
  EXPECT_EQ(tooDeepLine("\"a\".'b'.c = 4", 1), 1);
}

TEST(ShallowToml, KeysUnderAHeaderAreDeeperByIt) {
  EXPECT_EQ(tooDeepLine("[a]\nx = 1\n[a.b]\nc.d = 1", 2), 4);
  EXPECT_EQ(tooDeepLine("[a.b]\nx = 1\n[a]\nc.d = 1", 2), std::nullopt);
  EXPECT_EQ(tooDeepLine("[a.b] # c.d\nx.y = 1", 2), 2);
}

TEST(ShallowToml, ManyThingsBesideOneAnotherAreNotDeep) {
  std::string text;
  for (int i = 0; i < 1000; ++i) text += "[a.b]\nc = [1.5, -2.5e3, [0.1], { d = 1.5, e = 2.5 }]\n";
  EXPECT_EQ(tooDeepLine(text, 4), std::nullopt);
  EXPECT_EQ(tooDeepLine("t = 12:30:00.5\nf = [\n1.5,\n2.5,\n]", 1), std::nullopt);
  EXPECT_EQ(tooDeepLine("a = { b.c = 1, d.e = 1, f.g = 1 }", 2), std::nullopt);
}

TEST(ShallowToml, StringsAndCommentsCountForNothing) {
  for (const char* text : {"\"a.b.c\" = 'd.e.f[[['", "a = \"[{\\\".[{\" # .[[[", "# a.b.c.d = [[[",
                           "a = '\\' # '.'\nb = 1", "a = \"\"\"\n[b.c.d]\n\\\"\"\" \"\" [[[\"\"\"\"\" # x",
                           "a = '''\n[b.c.d]\n'' x.y'''''", "a = \"\" # .", "a = \"\"\"\"\"\" # [[["})
    EXPECT_EQ(tooDeepLine(text, 1), std::nullopt) << text;
  EXPECT_EQ(tooDeepLine("a = \"\"\"x\n\"\"\"\nb.c.d = 1", 1), 3);
  EXPECT_EQ(tooDeepLine("a = '''x'''''\nb.c.d = 1", 1), 2);
  EXPECT_EQ(tooDeepLine("a = '\\'\nb.c.d = 1", 1), 2);
  EXPECT_EQ(tooDeepLine("a = \"\"\nb.c.d = 1", 1), 2);
}

TEST(ShallowToml, EveryBeginningOfATextIsTakenAndNoDeeper) {
  const std::string text = "a.b = \"\"\"x\\\"\n\"\"\"\n[c.'d'] # e\nf = [1.5, { g.h = '''i''' }, []]\n";
  ASSERT_EQ(tooDeepLine(text, 5), std::nullopt);
  for (size_t length = 0; length < text.size(); ++length)
    EXPECT_EQ(tooDeepLine(text.substr(0, length), 5), std::nullopt);
}

TEST(ShallowToml, LongTextsAreReadThrough) {
  const std::string many = "x = " + std::string(1000000, '[');
  EXPECT_EQ(tooDeepLine(many, 64), 1);
  EXPECT_EQ(tooDeepLine("x = " + std::string(1000000, '"'), 64), std::nullopt);
  EXPECT_EQ(tooDeepLine(dotted(500000) + " = 1", 1000000), std::nullopt);
  EXPECT_EQ(tooDeepLine(dotted(65) + " = 1", 64), std::nullopt);
  EXPECT_EQ(tooDeepLine(dotted(66) + " = 1", 64), 1);
}

} // namespace
} // namespace surflect::scene
