#include "render/evaluation/label.h"

#include <array>
#include <cassert>

namespace surflect::evaluation {

namespace {

constexpr int kPerRow = 16; // glyphs
// Glyphs from the blank on, in ASCII order; the last one is the box.
constexpr std::array<std::string_view, 6 * kLabelHeight> kGlyphs = {
    "        #    # #   # #    #   ##  #  ##     #      #   #                                      #",
    "        #    # #   # #   #### ##  # #  #    #     #     #     #     #                         #",
    "        #    # #  ##### # #      #  # #     #    #       #  # # #   #                        # ",
    "        #          # #   ###    #    #           #       #   ###  #####        ###          #  ",
    "        #         #####   # #  #    # # #        #       #  # # #   #                      #   ",
    "                   # #  ####  #  ## #  #          #     #     #     #     #          ##   #    ",
    "        #          # #    #   #  ##  ## #          #   #                  #          ##   #    ",
    "                                                                         #                     ",
    " ###    #    ###  #####    #  #####   ##  #####  ###   ###                 #         #     ### ",
    "#   #  ##   #   #    #    ##  #      #        # #   # #   #  ##    ##     #           #   #   #",
    "#  ##   #       #   #    # #  ####  #        #  #   # #   #  ##    ##    #    #####    #      #",
    "# # #   #      #     #  #  #      # ####    #    ###   ####             #               #    # ",
    "##  #   #     #       # #####     # #   #   #   #   #     #  ##    ##    #    #####    #    #  ",
    "#   #   #    #    #   #    #  #   # #   #   #   #   #    #   ##     #     #           #        ",
    " ###   ###  #####  ###     #   ###   ###    #    ###   ##          #       #         #      #  ",
    "                                                                                               ",
    " ###   ###  ####   ###  ###   ##### #####  ###  #   #  ###    ### #   # #     #   # #   #  ### ",
    "#   # #   # #   # #   # #  #  #     #     #   # #   #   #      #  #  #  #     ## ## ##  # #   #",
    "# ### #   # #   # #     #   # #     #     #     #   #   #      #  # #   #     # # # ##  # #   #",
    "# # # ##### ####  #     #   # ####  ####  # ### #####   #      #  ##    #     # # # # # # #   #",
    "# ### #   # #   # #     #   # #     #     #   # #   #   #      #  # #   #     #   # #  ## #   #",
    "#     #   # #   # #   # #  #  #     #     #   # #   #   #   #  #  #  #  #     #   # #  ## #   #",
    " #### #   # ####   ###  ###   ##### #      #### #   #  ###   ##   #   # ##### #   # #   #  ### ",
    "                                                                                               ",
    "####   ###  ####   #### ##### #   # #   # #   # #   # #   # #####  ###  #      ###    #        ",
    "#   # #   # #   # #       #   #   # #   # #   # #   # #   #     #  #    #        #   # #       ",
    "#   # #   # #   # #       #   #   # #   # #   #  # #   # #     #   #     #       #  #   #      ",
    "####  #   # ####   ###    #   #   # #   # # # #   #     #     #    #      #      #             ",
    "#     # # # # #       #   #   #   #  # #  # # #  # #    #    #     #       #     #             ",
    "#     #  #  #  #      #   #   #   #  # #  ## ## #   #   #   #      #        #    #             ",
    "#      ## # #   # ####    #    ###    #   #   # #   #   #   #####  ###      #  ###             ",
    "                                                                                          #####",
    " #          #               #         ##        #       #      #  #      ##                    ",
    "  #         #               #        #          #                 #       #                    ",
    "       ###  ####   ####  ####  ###  ####   #### ####   ##     ##  #  #    #   ## #  ####   ### ",
    "          # #   # #     #   # #   #  #    #   # #   #   #      #  # #     #   # # # #   # #   #",
    "       #### #   # #     #   # #####  #    #   # #   #   #      #  ##      #   # # # #   # #   #",
    "      #   # #   # #     #   # #      #     #### #   #   #      #  # #     #   # # # #   # #   #",
    "       #### ####   ####  ####  ####  #        # #   #  ###     #  #  #   ###  # # # #   #  ### ",
    "                                           ###               ##                                ",
    "                         #                                           #    #    #          #####",
    "                         #                                          #     #     #         #   #",
    "####   #### # ##   #### ####  #   # #   # #   # #   # #   # #####   #     #     #         #   #",
    "#   # #   # ##    #      #    #   # #   # # # #  # #  #   #    #   #      #      #   #    #   #",
    "#   # #   # #      ###   #    #   #  # #  # # #   #   #   #   #     #     #     #   # # # #   #",
    "####   #### #         #  #    #   #  # #  # # #  # #   ####  #      #     #     #      #  #   #",
    "#         # #     ####    ##   ####   #    # #  #   #     # #####    #    #    #          #####",
    "#         #                                            ###                                     ",
};
// clang-format on

bool isInk(char character, int x, int y) {
  const int code = character >= ' ' && character <= '~' ? character - ' ' : 6 * kPerRow - 1;
  const auto row = static_cast<size_t>(code / kPerRow * kLabelHeight + y);
  const auto column = static_cast<size_t>(code % kPerRow * kLabelAdvance + x);
  return column < kGlyphs[row].size() && kGlyphs[row][column] == '#';
}

} // namespace

int drawLabel(image::Image& image, int x, int y, std::string_view text, Rgb color, int scale) {
  assert(image.channels == 3 && scale > 0);
  for (const char character : text) {
    for (int j = std::max(0, -y); j < scale * kLabelHeight && y + j < image.height; ++j)
      for (int i = std::max(0, -x); i < scale * kLabelAdvance && x + i < image.width; ++i)
        if (isInk(character, i / scale, j / scale)) {
          const auto pixel = image.at(x + i, y + j);
          pixel[0] = color.r, pixel[1] = color.g, pixel[2] = color.b;
        }
    x += scale * kLabelAdvance;
  }
  return x;
}

} // namespace surflect::evaluation
