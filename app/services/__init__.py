"""What a study means; services think, storage asks, routers commit."""
