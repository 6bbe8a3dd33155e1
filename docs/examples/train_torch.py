"""Train a small network: where can one walk, sit and reach, seen only from what people did?

    hsbench generate activity-maps --size small --frames none --out data/maps
    python docs/examples/train_torch.py data/maps

Input: three activity maps. Target: three affordance maps seen from above, in cells of 20 cm.
"""

import sys

import torch
from torch import nn
from torch.nn import functional
from torch.utils.data import DataLoader

from hsbench import load
from hsbench.torch import EpisodeDataset, collate, mirrored

EPOCHS, BATCH, POOLED, WIDTH = 5, 16, 4, 24
CLASSES = ("walkable", "sittable", "interactable")  # the first bits of the labels
WEIGHTS = torch.tensor([2.0, 6.0, 6.0])[:, None, None]  # what affords something is rare


def maps_and_target(batch):
    """(B, 3, s, s) activity, and (B, 3, s, s) share of each cell that a class covers."""
    bits = torch.stack([batch["affordance"] >> bit & 1 for bit in range(len(CLASSES))], dim=1).float()
    return functional.max_pool2d(batch["maps"], POOLED), functional.avg_pool2d(bits, POOLED)


def sometimes_mirrored(sample, rng):
    return mirrored(sample) if rng.random() < 0.5 else sample


def iou(answer, batches):
    """IoU of each class, over all cells: ``answer`` turns maps into scores, above 0 for yes."""
    both = either = torch.zeros(len(CLASSES))
    with torch.no_grad():
        for maps, target in map(maps_and_target, batches):
            said, true = answer(maps) > 0, target > 0.5
            both, either = both + (said & true).sum((0, 2, 3)), either + (said | true).sum((0, 2, 3))
    return ", ".join(f"{name} {value:.2f}" for name, value in zip(CLASSES, both / either, strict=True))


def main(folder):
    torch.manual_seed(0)
    fields = ("maps", "affordance")
    train = EpisodeDataset(load(folder, "train", truth=True), sometimes_mirrored, fields)
    val = EpisodeDataset(load(folder, "val", truth=True), fields=fields)
    batches = DataLoader(train, BATCH, shuffle=True, collate_fn=collate)
    held_out = DataLoader(val, BATCH, collate_fn=collate)
    layers = []
    for channels, reach in ((3, 1), (WIDTH, 1), (WIDTH, 2), (WIDTH, 4), (WIDTH, 8)):
        layers += [nn.Conv2d(channels, WIDTH, 3, padding=reach, dilation=reach), nn.BatchNorm2d(WIDTH), nn.ReLU()]
    network = nn.Sequential(*layers, nn.Conv2d(WIDTH, len(CLASSES), 1))
    optimiser = torch.optim.Adam(network.parameters())
    pace = torch.optim.lr_scheduler.OneCycleLR(optimiser, 1e-2, epochs=EPOCHS, steps_per_epoch=len(batches))
    print(f"val IoU, where people were seen to: {iou(lambda maps: maps - 0.02, held_out)}")
    for epoch in range(EPOCHS):
        network.train()
        for maps, target in map(maps_and_target, batches):
            loss = functional.binary_cross_entropy_with_logits(network(maps), target, pos_weight=WEIGHTS)
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            pace.step()
        network.eval()
        print(f"epoch {epoch + 1}: loss {loss.item():.3f}, val IoU {iou(network, held_out)}")


if __name__ == "__main__":
    main(sys.argv[1])
