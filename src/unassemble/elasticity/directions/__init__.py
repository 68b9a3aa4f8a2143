"""Which direction each row belongs to, from sums and from solving for translations."""
