"""Renderers beside Penumbra. Each module has variants(scene): name → (budgets, render(budget, threads, edge))."""


class NotExpressible(Exception):
    """Something in the scene that the peer has no words for."""
