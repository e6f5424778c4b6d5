//! The text under the figure.

/// What the notions are, and what they do to the built-in shapes.
pub(super) const TEXT: &str = "\
The same plane shapes under several notions of mean and distance, each in a small implementation of this program \
(`cli/src/figure/related`) that shows what the notion does, and not how fast or how well others compute it.

- **Elastic average, viscous paths**: the average of this program, and the lengths of its paths of 4 steps. \
**Elastic median**: its median, of the same distances.
- **Linear elasticity**: the same average for the energy `lambda/2 (tr e)^2 + mu tr e^2`, `e` the symmetric part of \
the gradient of the displacement; distances are roots of this energy for one deformation of each shape into each \
later one. Fuchs, Jüttler, Scherzer and Yang (2009) take the length of paths by this energy of velocities; in the \
limit of many small steps that is the length of the viscous paths, so that only the single large step is compared.
- **Signed distances in L2**: the zero level set of the mean of the signed distances (Leventon, Grimson and Faugeras \
2000).
- **Smoothed Hausdorff**: means of fourth powers of distances in place of their maximum, and a local minimum of the \
sum of squares by descent (Charpiat, Faugeras and Keriven 2005), without their term of the perimeter.
- **Landmarks, Procrustes**: 128 landmarks at equal distances along the outline, in the best cyclic order, up to \
similarities: full Procrustes distance and mean (Kendall 1984). **Landmarks, median**: the geometric median in this \
space by the iteration of Weiszfeld (Fletcher, Venkatasubramanian and Joshi 2009).
- **Elastic curves (SRVF)**: outlines up to similarities and reparametrisations in the elastic metric of square-root \
velocities (Srivastava, Klassen, Joshi and Jermyn 2011), by dynamic programming, closed curves among open ones.

Landmarks and elastic curves have neither place nor size: their means are drawn at the mean place, of the mean size \
(of landmarks) or length (of curves).

Area, thickness (the largest diameter for which disks in the shape cover 0.8 of it) and protrusion (how far the \
shape reaches beyond the disks in it of 0.9 of its largest radius) are those of the mean, relative to the means of \
those of the shapes; without pins or fingers the protrusion is that of corners, which says little. The distances of \
all pairs are relative to their mean. `arrive` counts the pairs whose path arrives at its end; seconds are those on \
the clock for mean and distances together, and tell orders of magnitude. What the built-in shapes show:

- *Bars.* All means bend half as far. The elastic average keeps area and thickness to 1 %. Linear elasticity takes \
turned arms for strained ones, and the mean has 5 % more area. The mean of signed distances and that of the \
Hausdorff distance lose area at the ends; landmarks and elastic curves, which do not know the area, gain 2 % and 9 \
%.
- *Pins.* Nothing identifies the two pins with each other at their places. Elastic average and signed distances keep \
two low pins, and so does the Hausdorff mean, higher ones, but uneven, and the sides of the block are in waves. A \
median of two shapes is any point between them: the elastic one has moved to one of them. Landmarks and elastic \
curves lay one block on the other as it fits best: the landmarks after half a turn, so that both pins come to the \
left side and the block is bent; for the curves the pin is a piece of outline, of which a wide block remains. Where \
places matter, these two are the wrong notions; where they do not, the others need an alignment first. The elastic \
averages of the pins are doubtful: their deformations are at the bound of the determinant.
- *Hands.* Every mean is a hand. Signed distances shorten the fingers that move most; the averages by elasticity, \
landmarks and curves keep them. Elastic curves keep the lengths of the fingers best, with 4 % more area and thicker \
fingers, in seconds: where the outline is what matters, they are the cheaper choice. The order of the pairs differs: \
the two closest by signed distances are not the two closest by elastic energy, to which a finger that turns as a \
whole is little. By linear elasticity one pair is at 2.8 times the mean: a single large step.

Only the elastic notions know the inside: thin parts resist, and holes count. They are by far the slowest.";
